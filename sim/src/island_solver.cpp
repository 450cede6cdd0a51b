#include "island_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sim {
namespace {

constexpr double kPushHz = 30, kPushDamping = 10;
constexpr float kPushSpeed = 3;           // [m/s]
constexpr float kBounceThreshold = 0.1f;  // [m/s]

float dot(const float* a, const float* b, int width) {
    Lanes sum = load_lanes(a) * load_lanes(b);
    for (int i = kLanes; i < width; i += kLanes) sum = fused(load_lanes(a + i), load_lanes(b + i), sum);
    return sum_of(sum);
}

/// Three rows against one vector, added to three sums.
template <int kWidth>
void dot_rows(const float* rows, const float* y, int any_width, Lanes (&sum)[3]) {
    const int width = kWidth ? kWidth : any_width;
    for (int i = 0; i < width; i += kLanes) {
        const Lanes x = load_lanes(y + i);
        for (int r = 0; r < 3; ++r) sum[r] = fused(load_lanes(rows + r * width + i), x, sum[r]);
    }
}

/// y += rows^T p.
template <int kWidth>
void add_rows_to(const float* rows, const float (&p)[3], int any_width, float* y) {
    const int width = kWidth ? kWidth : any_width;
    const Lanes p0 = lanes_of(p[0]), p1 = lanes_of(p[1]), p2 = lanes_of(p[2]);
    for (int i = 0; i < width; i += kLanes)
        store_lanes(y + i, fused(p2, load_lanes(rows + 2 * width + i),
                                 fused(p1, load_lanes(rows + width + i),
                                       fused(p0, load_lanes(rows + i), load_lanes(y + i)))));
}

// The usual widths (9 to 16 modes, rigid, linear) unrolled.
[[gnu::always_inline]] inline void dot_rows(const float* rows, const float* y, int width, Lanes (&sum)[3]) {
    if (width == 24) return dot_rows<24>(rows, y, width, sum);
    if (width == 8) return dot_rows<8>(rows, y, width, sum);
    if (width == 16) return dot_rows<16>(rows, y, width, sum);
    dot_rows<0>(rows, y, width, sum);
}
[[gnu::always_inline]] inline void add_rows_to(const float* rows, const float (&p)[3], int width, float* y) {
    if (width == 24) return add_rows_to<24>(rows, p, width, y);
    if (width == 8) return add_rows_to<8>(rows, p, width, y);
    if (width == 16) return add_rows_to<16>(rows, p, width, y);
    add_rows_to<0>(rows, p, width, y);
}

// Without the library's check for negative arguments.
float root(float x) {
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x)));
}

/// Two unit vectors square to n and to each other.
void set_tangents(const Eigen::Vector3f& n, Eigen::Vector3f (&t)[2]) {
    const Eigen::Vector3f axis =
        std::abs(n.x()) < 0.6f ? Eigen::Vector3f::UnitX() : Eigen::Vector3f(Eigen::Vector3f::UnitZ());
    t[0] = (axis - axis.dot(n) * n).normalized();
    t[1] = n.cross(t[0]);
}

}  // namespace

void IslandSolver::solve(const Island& island) {
    begin(island);
    for (int i = 0; i < settings_->substeps; ++i) substep(i == 0, i + 1 == settings_->substeps);
    keep_impulses();
    for (const int id : island.bodies) local_[static_cast<std::size_t>(id)] = -1;
}

void IslandSolver::begin(const Island& island) {
    h_ = settings_->dt / settings_->substeps;
    inverse_h_ = static_cast<float>(1 / h_);
    const double omega = 2 * std::numbers::pi * std::min(kPushHz, 0.25 / h_);
    const double a1 = 2 * kPushDamping + h_ * omega, a2 = h_ * omega * a1;
    push_rate_ = static_cast<float>(omega / a1);
    mass_share_ = static_cast<float>(a2 / (1 + a2));
    impulse_share_ = static_cast<float>(1 / (1 + a2));

    local_.resize(bodies_->size(), -1);
    rows_of_.clear();
    std::uint32_t offset = 0;
    for (const int id : island.bodies) {
        MovingBody& body = (*bodies_)[static_cast<std::size_t>(id)];
        local_[static_cast<std::size_t>(id)] = static_cast<int>(rows_of_.size());
        rows_of_.push_back({&body, offset, body.kind->width, body.state.position, body.posed.rotation,
                            body.posed.rotation.transpose().cast<float>()});
        offset += static_cast<std::uint32_t>(body.kind->width);
    }
    y_.resize(offset), start_.resize(offset), moved_.resize(offset), kept_.resize(offset);
    std::fill_n(moved_.data(), offset, 0.f);

    std::size_t triples = 0, floats = 0;
    auto width_of = [this](int id) {
        return id >= 0 && id < kFirstPlane && local(id) >= 0
                   ? static_cast<std::size_t>((*bodies_)[static_cast<std::size_t>(id)].kind->width)
                   : 0;
    };
    for (const int m : island.manifolds) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        triples += static_cast<std::size_t>(manifold.count);
        floats +=
            static_cast<std::size_t>(manifold.count) * 3 * (width_of(manifold.a) + width_of(manifold.b));
    }
    for (const int c : island.constraints) {
        const PointConstraint& held = (*constraints_)[static_cast<std::size_t>(c)].definition;
        floats += 3 * (width_of(held.body_a) + width_of(held.body_b));
    }
    jacobians_.resize(floats);
    jacobians_used_ = 0;
    contacts_.clear(), springs_.clear();
    contacts_.reserve(triples);
    for (const Turn& turn : in_turns(island))
        add_contact(*turn.manifold, turn.manifold->points[static_cast<std::size_t>(turn.point)]);
    for (const int c : island.constraints) add_spring((*constraints_)[static_cast<std::size_t>(c)]);
}

const std::vector<IslandSolver::Turn>& IslandSolver::in_turns(const Island& island) {
    by_turn_.clear(), window_.clear();
    next_turn_.assign(rows_of_.size(), 0);
    for (const int m : island.manifolds) {
        Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        for (int i = 0; i < manifold.count; ++i) {
            if (window_.size() == kWindow) flush_window();
            int turn = 0;
            for (const int id : {manifold.a, manifold.b})
                if (id < kFirstPlane && local(id) >= 0)
                    turn = std::max(turn, next_turn_[static_cast<std::size_t>(local(id))]);
            for (const int id : {manifold.a, manifold.b})
                if (id < kFirstPlane && local(id) >= 0)
                    next_turn_[static_cast<std::size_t>(local(id))] = turn + 1;
            window_.push_back({&manifold, i, turn});
        }
    }
    flush_window();
    return by_turn_;
}

// Appends the window's contacts by turn, each turn's in order of ids, and begins anew.
void IslandSolver::flush_window() {
    std::array<int, kWindow + 1> first{};
    for (const Turn& t : window_) ++first[static_cast<std::size_t>(t.turn) + 1];
    for (std::size_t t = 1; t < first.size(); ++t) first[t] += first[t - 1];
    const std::size_t base = by_turn_.size();
    by_turn_.resize(base + window_.size());
    for (const Turn& t : window_)
        by_turn_[base + static_cast<std::size_t>(first[static_cast<std::size_t>(t.turn)]++)] = t;
    for (const Turn& t : window_)
        for (const int id : {t.manifold->a, t.manifold->b})
            if (id < kFirstPlane && local(id) >= 0) next_turn_[static_cast<std::size_t>(local(id))] = 0;
    window_.clear();
}

IslandSolver::Place IslandSolver::place(int body, const Eigen::Vector3f& arm, int sample,
                                        const Eigen::Vector3f& rest, float* scratch) {
    const bool moves = body >= 0 && body < kFirstPlane && local(body) >= 0;
    if (!moves) return {-1, arm, nullptr};
    const BodyKind& kind = *(*bodies_)[static_cast<std::size_t>(body)].kind;
    if (kind.modes == 0) return {local(body), arm, nullptr};
    if (sample >= 0)
        return {local(body), arm,
                kind.sample_shapes.data() + static_cast<std::size_t>(sample) * 3 * kind.mode_width};
    kind.shapes_at(rest, scratch);
    return {local(body), arm, scratch};
}

IslandSolver::Side IslandSolver::reserve_rows(int body) {
    if (body < 0) return {};
    const BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
    const Side side{body, rows.width, static_cast<std::uint32_t>(jacobians_used_), rows.offset};
    jacobians_used_ += 3 * static_cast<std::size_t>(rows.width);
    return side;
}

void IslandSolver::write_rows(const Place& place, const Eigen::Matrix3f& directions, float sign,
                              const Side& side) {
    if (place.body < 0) return;
    const BodyRows& rows = rows_of_[static_cast<std::size_t>(place.body)];
    const BodyKind& kind = *rows.body->kind;
    const Eigen::Matrix3f& body_from_world = rows.body_from_world;
    const Eigen::Vector3f root_inertia = kind.root_inertia.cast<float>().cwiseInverse();
    const float root_mass = static_cast<float>(1 / kind.root_mass);
    for (int r = 0; r < 3; ++r) {
        float* out = jacobians_.data() + side.rows + r * side.width;
        const Eigen::Vector3f world = sign * directions.row(r).transpose();
        const Eigen::Vector3f turn = (body_from_world * place.arm.cross(world)).cwiseProduct(root_inertia);
        for (int i = 0; i < 3; ++i) out[i] = root_mass * world[i], out[3 + i] = turn[i];
        out[6] = out[7] = 0;
        if (!place.shapes) continue;
        const Eigen::Vector3f own = body_from_world * world;
        const int width = kind.mode_width;
        for (int k = 0; k < width; k += kLanes)
            store_lanes(out + 8 + k, load_lanes(kind.root_compliance.data() + k) *
                                         (own.x() * load_lanes(place.shapes + k) +
                                          own.y() * load_lanes(place.shapes + width + k) +
                                          own.z() * load_lanes(place.shapes + 2 * width + k)));
    }
}

void IslandSolver::finish_rows(Rows& rows) {
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) {
            float sum = 0;
            for (const Side& side : rows.side) {
                if (side.body < 0) continue;
                const float* d = jacobians_.data() + side.rows;
                sum += dot(d + i * side.width, d + j * side.width, side.width);
            }
            rows.k[i][j] = rows.k[j][i] = sum;
        }
}

void IslandSolver::add_contact(Manifold& manifold, ManifoldPoint& point) {
    alignas(32) float scratch[2][3 * 128];
    ContactRows c{};
    c.place.setZero();
    const Place a = place(manifold.a, point.arm_a, point.sample_a, point.rest, scratch[0]);
    const Place b = place(manifold.b, point.arm_b, point.sample_b, point.rest, scratch[1]);
    set_tangents(point.normal, c.tangent);
    Eigen::Matrix3f directions;
    directions << point.normal.transpose(), c.tangent[0].transpose(), c.tangent[1].transpose();
    c.side[0] = reserve_rows(a.body);
    write_rows(a, directions, 1, c.side[0]);
    c.side[1] = reserve_rows(b.body);
    write_rows(b, directions, -1, c.side[1]);
    finish_rows(c);
    c.point = &point;
    c.separation = c.now = point.separation;
    c.friction = manifold.friction;
    // Only what comes together rebounds, not what rests and rings.
    c.restitution = point.normal_impulse > 0 ? 0 : manifold.restitution;
    c.approach = 0, c.largest = 0, c.taken = 0;
    c.emerging = manifold.emerging;
    c.inverse_normal = 1 / c.k[0][0];
    c.slide_mass = 2 / (c.k[1][1] + c.k[2][2]);
    const float det = c.k[1][1] * c.k[2][2] - c.k[1][2] * c.k[1][2];
    c.inverse_tangent[0] = c.k[2][2] / det, c.inverse_tangent[1] = -c.k[1][2] / det,
    c.inverse_tangent[2] = c.k[1][1] / det;
    c.impulse[0] = point.normal_impulse;
    c.impulse[1] = point.friction_impulse.dot(c.tangent[0]);
    c.impulse[2] = point.friction_impulse.dot(c.tangent[1]);
    contacts_.push_back(c);
}

void IslandSolver::add_spring(HeldConstraint& constraint) {
    const PointConstraint& held = constraint.definition;
    SpringRows s{};
    s.place.setZero();
    auto local_of = [this](int body) { return body >= 0 ? local(body) : -1; };
    s.side[0] = reserve_rows(local_of(held.body_a));
    s.side[1] = reserve_rows(local_of(held.body_b));
    s.constraint = &constraint;
    for (int i = 0; i < 3; ++i) s.impulse[i] = constraint.impulse[i];
    springs_.push_back(s);
}

IslandSolver::End IslandSolver::end_of(int body, const Eigen::Vector3d& rest, float* shapes) const {
    if (body < 0) return {rest, {-1, Eigen::Vector3f::Zero(), nullptr}};
    const MovingBody& b = (*bodies_)[static_cast<std::size_t>(body)];
    const BodyKind& kind = *b.kind;
    Eigen::Vector3d point = rest;
    if (kind.modes > 0) {
        kind.shapes_at(rest.cast<float>(), shapes);
        for (int axis = 0; axis < 3; ++axis)
            for (int k = 0; k < kind.modes; ++k)
                point[axis] += static_cast<double>(shapes[axis * kind.mode_width + k]) * b.state.q[k];
    }
    const Eigen::Vector3d arm = b.state.orientation * point;
    return {b.state.position + arm, {local(body), arm.cast<float>(), kind.modes > 0 ? shapes : nullptr}};
}

// Springs act over large turns, so their arms and rows follow the bodies every substep.
void IslandSolver::refresh(SpringRows& s) {
    const PointConstraint& held = s.constraint->definition;
    alignas(32) float scratch[2][3 * 128];
    const End a = end_of(held.body_a, held.point_a, scratch[0]);
    const End b = end_of(held.body_b, held.point_b, scratch[1]);
    const Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();
    write_rows(a.place, axes, 1, s.side[0]);
    write_rows(b.place, axes, -1, s.side[1]);
    finish_rows(s);
    s.place = (a.point + b.point) / 2;
    const double mass = 3.0 / (s.k[0][0] + s.k[1][1] + s.k[2][2]), k = held.stiffness;
    const double damping = 2 * held.damping_ratio * std::sqrt(k * mass), firm = damping + h_ * k;
    s.gamma = static_cast<float>(1 / (h_ * firm));
    s.pull = static_cast<float>(k / firm);
    Eigen::Matrix3d soft;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) soft(i, j) = s.k[i][j] + (i == j ? s.gamma : 0);
    const Eigen::Matrix3d inverse = soft.inverse();
    const Eigen::Vector3d error = a.point - b.point;
    for (int i = 0; i < 3; ++i) {
        s.error[i] = static_cast<float>(error[i]);
        for (int j = 0; j < 3; ++j) s.inverse[i][j] = static_cast<float>(inverse(i, j));
    }
}

void IslandSolver::substep(bool first, bool last) {
    load_velocities();
    for (SpringRows& spring : springs_) refresh(spring);
    warm_start(first);
    sweep(Push::soft);
    push_out();
    sweep(Push::none);
    note_work();
    if (last) restitute();
    finish();
}

void IslandSolver::load_velocities() {
    for (BodyRows& rows : rows_of_) {
        const MovingBody& body = *rows.body;
        const BodyKind& kind = *body.kind;
        const WorldBodyState& s = body.state;
        rows.place = s.position;
        if (contacts_.empty()) {
            rows.frame = s.orientation.toRotationMatrix();
            rows.body_from_world = rows.frame.transpose().cast<float>();
        }
        const Eigen::Matrix3d& frame = rows.frame;
        Eigen::Vector3d velocity = s.velocity + h_ * body.gravity_scale * settings_->gravity;
        Eigen::Vector3d momentum = s.angular_momentum;
        if (body.pushed) {
            velocity += h_ / kind.mass.mass * body.force;
            momentum += h_ * body.torque;
        }
        const Eigen::Matrix3d turned = s.orientation.toRotationMatrix();
        const Eigen::Vector3d spin =
            frame.transpose() * (turned * (turned.transpose() * momentum).cwiseQuotient(kind.mass.inertia));
        const double root_mass = kind.root_mass;
        float* y = start_.data() + rows.offset;
        for (int i = 0; i < 3; ++i) {
            y[i] = static_cast<float>(root_mass * velocity[i]);
            y[3 + i] = static_cast<float>(kind.root_inertia[i] * spin[i]);
        }
        y[6] = y[7] = 0;
        const HeldSteps& step = kind.substep;
        Eigen::Map<Eigen::ArrayXf> mean(y + 8, kind.modes);
        mean = ((step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array()) / step.root_compliance)
                   .cast<float>();
        if (body.pushed) mean += (step.root_compliance * h_ * body.modal_force.array()).cast<float>();
        for (int k = kind.modes; k < kind.mode_width; ++k) y[8 + k] = 0;
        std::copy_n(y, rows.width, y_.data() + rows.offset);
    }
}

void IslandSolver::warm_start(bool first) {
    // Approach speeds first, before any impulse: gravity's share of this substep included, as it is real.
    for (ContactRows& c : contacts_) {
        float speed = 0, moved = 0;
        for (const Side& side : c.side) {
            if (side.body < 0) continue;
            const float* d = jacobians_.data() + side.rows;
            if (c.restitution > 0 && c.largest == 0) speed += dot(d, start_.data() + side.y, side.width);
            if (!first) moved += dot(d, moved_.data() + side.y, side.width);
        }
        if (c.largest == 0) c.approach = speed;
        c.now = c.separation + moved;
        if (c.impulse[0] != 0) push_by(c, c.impulse);
    }
    for (SpringRows& s : springs_) push_by(s, s.impulse);
}

// Positions move with velocities that also push emerging bodies out; the velocities themselves never see it.
void IslandSolver::push_out() {
    const bool emerging = std::any_of(contacts_.begin(), contacts_.end(),
                                      [](const ContactRows& c) { return c.emerging && c.now < 0; });
    if (!emerging) return move();
    auto save = [](auto& rows) {
        for (auto& row : rows) std::copy_n(row.impulse, 3, row.kept);
    };
    auto restore = [](auto& rows) {
        for (auto& row : rows) std::copy_n(row.kept, 3, row.impulse);
    };
    std::copy_n(y_.data(), y_.size(), kept_.data());
    save(contacts_), save(springs_);
    sweep(Push::all);
    move();
    std::copy_n(kept_.data(), y_.size(), y_.data());
    restore(contacts_), restore(springs_);
}

void IslandSolver::sweep(Push push) {
    for (SpringRows& spring : springs_) solve_spring(spring);
    for (ContactRows& contact : contacts_) solve_contact(contact, push);
}

// What the rows see of the velocities.
inline void IslandSolver::speeds(const Rows& rows, float (&v)[3]) const {
    Lanes sum[3] = {lanes_of(0), lanes_of(0), lanes_of(0)};
    for (const Side& side : rows.side)
        if (side.body >= 0) dot_rows(jacobians_.data() + side.rows, y_.data() + side.y, side.width, sum);
    for (int r = 0; r < 3; ++r) v[r] = sum_of(sum[r]);
}

inline void IslandSolver::push_by(const Rows& rows, const float (&impulse)[3]) {
    for (const Side& side : rows.side)
        if (side.body >= 0)
            add_rows_to(jacobians_.data() + side.rows, impulse, side.width, y_.data() + side.y);
}

void IslandSolver::solve_spring(SpringRows& s) {
    float v[3];
    speeds(s, v);
    for (int i = 0; i < 3; ++i) v[i] += s.pull * s.error[i] + s.gamma * s.impulse[i];
    float p[3];
    for (int i = 0; i < 3; ++i) {
        p[i] = -(s.inverse[i][0] * v[0] + s.inverse[i][1] * v[1] + s.inverse[i][2] * v[2]);
        s.impulse[i] += p[i];
    }
    push_by(s, p);
}

void IslandSolver::solve_contact(ContactRows& c, Push push) {
    float v[3];
    speeds(c, v);
    // Selected, not branched: which case it is cannot be foretold.
    const bool soft = c.now <= 0 && (push == Push::all || (push == Push::soft && !c.emerging));
    const float bias = c.now > 0 ? c.now * inverse_h_ : soft ? std::max(push_rate_ * c.now, -kPushSpeed) : 0;
    const float mass_share = soft ? mass_share_ : 1, impulse_share = soft ? impulse_share_ : 0;
    const float normal = std::max(
        c.impulse[0] - mass_share * c.inverse_normal * (v[0] + bias) - impulse_share * c.impulse[0], 0.f);
    float p[3] = {normal - c.impulse[0], 0, 0};
    c.impulse[0] = normal;
    c.largest = std::max(c.largest, normal);
    v[1] += c.k[0][1] * p[0];
    v[2] += c.k[0][2] * p[0];
    const float stick0 = c.impulse[1] - (c.inverse_tangent[0] * v[1] + c.inverse_tangent[1] * v[2]);
    const float stick1 = c.impulse[2] - (c.inverse_tangent[1] * v[1] + c.inverse_tangent[2] * v[2]);
    // If it slides: against the speed, whatever the masses in either direction, so by one mass for both.
    const float most = c.friction * normal;
    const bool slides = stick0 * stick0 + stick1 * stick1 > most * most;
    const float slide0 = c.impulse[1] - c.slide_mass * v[1], slide1 = c.impulse[2] - c.slide_mass * v[2];
    const float scale = most / std::max(root(slide0 * slide0 + slide1 * slide1), 1e-30f);
    const float t0 = slides ? scale * slide0 : stick0, t1 = slides ? scale * slide1 : stick1;
    p[1] = t0 - c.impulse[1], p[2] = t1 - c.impulse[2];
    c.impulse[1] = t0, c.impulse[2] = t1;
    if (p[0] != 0 || p[1] != 0 || p[2] != 0) push_by(c, p);
}

// Energy that a contact's normal impulse takes out in this substep, where it may have to give some back: held
// over the substep, it does p (v0 + v1) / 2 on the rigid part and p G on the modes.
void IslandSolver::note_work() {
    for (ContactRows& c : contacts_) {
        if (c.restitution == 0 || c.largest == 0) continue;
        float mean = 0;
        for (const Side& side : c.side) {
            if (side.body < 0) continue;
            const float* d = jacobians_.data() + side.rows;
            const float *before = start_.data() + side.y, *after = y_.data() + side.y;
            mean += (dot(d, before, 8) + dot(d, after, 8)) / 2;
            if (side.width > 8) mean += dot(d + 8, after + 8, side.width - 8);
        }
        c.taken -= c.impulse[0] * mean;
    }
}

// A rebound to e times the approach, by an impulse p whose work p v + p^2 (K_rigid / 2 + K_modes) is at most
// e^2 of the energy that the contact has taken. For rigid bodies both say the same.
void IslandSolver::restitute() {
    for (ContactRows& c : contacts_) {
        if (c.restitution == 0 || c.largest == 0 || c.approach > -kBounceThreshold) continue;
        float v[3];
        speeds(c, v);
        float rigid = 0;
        for (const Side& side : c.side)
            if (side.body >= 0) rigid += dot(jacobians_.data() + side.rows, jacobians_.data() + side.rows, 8);
        // The modes yield to p under the impulse of this substep, too.
        const float modes = c.k[0][0] - rigid, firm = rigid / 2 + modes, slope = v[0] + modes * c.impulse[0];
        const float budget = c.restitution * c.restitution * std::max(c.taken, 0.f);
        const float most = (std::sqrt(slope * slope + 4 * firm * budget) - slope) / (2 * firm);
        const float wanted = -c.inverse_normal * (v[0] + c.restitution * c.approach);
        const float p[3] = {std::clamp(wanted, 0.f, std::max(most, 0.f)), 0, 0};
        c.impulse[0] += p[0];
        push_by(c, p);
    }
}

void IslandSolver::move() {
    for (const BodyRows& rows : rows_of_) {
        MovingBody& body = *rows.body;
        const BodyKind& kind = *body.kind;
        const float* y = y_.data() + rows.offset;
        const float* start = start_.data() + rows.offset;
        float* moved = moved_.data() + rows.offset;
        const float h = static_cast<float>(h_);
        for (int i = 0; i < rows.width; ++i) moved[i] += h * y[i];
        WorldBodyState& s = body.state;
        const double root_mass = kind.root_mass;
        s.position += h_ / root_mass * Eigen::Vector3d(y[0], y[1], y[2]);
        Eigen::Vector3d change;
        for (int i = 0; i < 3; ++i) change[i] = kind.root_inertia[i] * (y[3 + i] - start[3 + i]);
        Eigen::Vector3d momentum = s.angular_momentum + rows.frame * change;
        if (body.pushed) momentum += h_ * body.torque;
        s.orientation = body.substep_rotation.advance(s.orientation, momentum);
    }
}

// Half-way between where the contact would be if it moved with either centre.
Eigen::Vector3d IslandSolver::place_now(const ContactRows& c) const {
    const Side &a = c.side[0], &b = c.side[1];
    auto with = [this](const Side& side, const Eigen::Vector3f& arm) -> Eigen::Vector3d {
        return rows_of_[static_cast<std::size_t>(side.body)].place + arm.cast<double>();
    };
    if (b.body < 0) return with(a, c.point->arm_a);
    if (a.body < 0) return with(b, c.point->arm_b);
    return (with(a, c.point->arm_a) + with(b, c.point->arm_b)) / 2;
}

// In double precision and at one point of space a pair, so that linear and angular momentum are kept to
// rounding.
void IslandSolver::apply(const Rows& rows, const Eigen::Vector3d& impulse, const Eigen::Vector3d& point) {
    for (const Side& side : rows.side) {
        if (side.body < 0) continue;
        const BodyRows& at = rows_of_[static_cast<std::size_t>(side.body)];
        WorldBodyState& s = at.body->state;
        const Eigen::Vector3d p = &side == &rows.side[0] ? impulse : Eigen::Vector3d(-impulse);
        s.velocity += p / at.body->kind->mass.mass;
        s.angular_momentum += (point - at.place).cross(p);
    }
}

void IslandSolver::finish() {
    for (ContactRows& c : contacts_) {
        if (c.impulse[0] == 0) continue;
        c.place = place_now(c);
        const Eigen::Vector3f p =
            c.impulse[0] * c.point->normal + c.impulse[1] * c.tangent[0] + c.impulse[2] * c.tangent[1];
        apply(c, p.cast<double>(), c.place);
    }
    for (const SpringRows& s : springs_)
        apply(s, Eigen::Vector3d(s.impulse[0], s.impulse[1], s.impulse[2]), s.place);
    for (const BodyRows& rows : rows_of_) {
        MovingBody& body = *rows.body;
        const BodyKind& kind = *body.kind;
        const float* y = y_.data() + rows.offset;
        const float* start = start_.data() + rows.offset;
        WorldBodyState& s = body.state;
        s.velocity += h_ * body.gravity_scale * settings_->gravity;
        s.velocity *= kind.substep_drag, s.angular_momentum *= kind.substep_drag;
        if (body.pushed) {
            s.velocity += h_ / kind.mass.mass * body.force;
            s.angular_momentum += h_ * body.torque;
        }
        const HeldSteps& step = kind.substep;
        const Eigen::Map<const Eigen::ArrayXf> now(y + 8, kind.modes), before(start + 8, kind.modes);
        held_.resize(kind.modes), mean_.resize(kind.modes);
        held_ = (now.cast<double>() - before.cast<double>()) / step.root_compliance;
        if (body.pushed) held_ += h_ * body.modal_force.array();
        mean_ = step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array() + step.compliance * held_;
        s.q_dot.array() = step.c * s.q.array() + step.d * s.q_dot.array() + step.rate * held_;
        s.q.array() += h_ * mean_;
        if (limit_deformation(body)) ++limited_;
    }
}

void IslandSolver::keep_impulses() {
    for (const ContactRows& c : contacts_) {
        c.point->normal_impulse = c.impulse[0];
        c.point->friction_impulse = c.impulse[1] * c.tangent[0] + c.impulse[2] * c.tangent[1];
    }
    for (const SpringRows& s : springs_) {
        for (int i = 0; i < 3; ++i) s.constraint->impulse[i] = s.impulse[i];
        const double force = s.constraint->impulse.norm() / h_;
        if (!(force > s.constraint->definition.breaking_force)) continue;
        s.constraint->holds = false;
        ++broken_;
    }
}

}  // namespace sim
