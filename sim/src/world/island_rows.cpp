#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "world/island_solver.h"
#include "world/row_kernels.h"

// What an island's rows are made of; island_solver.cpp sweeps over them.

namespace sim {
namespace {

constexpr double kPushHz = 30, kPushDamping = 10;

/// Two unit vectors square to n and to each other.
void set_tangents(const Eigen::Vector3f& n, Eigen::Vector3f (&t)[2]) {
    const Eigen::Vector3f axis =
        std::abs(n.x()) < 0.6f ? Eigen::Vector3f::UnitX() : Eigen::Vector3f(Eigen::Vector3f::UnitZ());
    t[0] = (axis - axis.dot(n) * n).normalized();
    t[1] = n.cross(t[0]);
}

}  // namespace

void IslandSolver::begin(const Island& island) {
    h_ = last_h_ = settings_->dt / settings_->substeps;
    level_ = 0;
    begin_times(0);
    inverse_h_ = static_cast<float>(1 / h_);
    const double omega = 2 * std::numbers::pi * std::min(kPushHz, 0.25 / h_);
    const double a1 = 2 * kPushDamping + h_ * omega, a2 = h_ * omega * a1;
    push_rate_ = static_cast<float>(omega / a1);
    mass_share_ = static_cast<float>(a2 / (1 + a2));
    impulse_share_ = static_cast<float>(1 / (1 + a2));

    local_.resize(bodies_->size(), -1);
    rows_of_.resize(island.bodies.size());
    std::uint32_t offset = 0;
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        MovingBody& body = (*bodies_)[static_cast<std::size_t>(island.bodies[i])];
        local_[static_cast<std::size_t>(island.bodies[i])] = static_cast<int>(i);
        rows_of_[i].body = &body, rows_of_[i].offset = offset, rows_of_[i].width = body.kind->width;
        offset += static_cast<std::uint32_t>(body.kind->width);
    }
    places_.resize(rows_of_.size());
    each_body([this](BodyRows& rows) {
        places_[static_cast<std::size_t>(&rows - rows_of_.data())] = {
            rows.body->state.position, 2 * rows.body->kind->half_box.maxCoeff()};
    });
    part_rebounds(false);
    y_.resize(offset), start_.resize(offset), moved_.resize(offset), kept_.resize(offset);
    std::fill_n(moved_.data(), offset, 0.f);

    found_again_ = false, fresh_ = true;
    note_places();
    add_contacts(island);
    for (const int c : island.constraints) {
        HeldConstraint& held = (*constraints_)[static_cast<std::size_t>(c)];
        for (int i = 0; i < held.count; ++i) add_spring(held, held.points[static_cast<std::size_t>(i)]);
    }
    springs_soft_ = springs_are_soft();
    pushed_.clear();
    for (std::size_t i = 0; i < rows_of_.size() && !forces_->empty(); ++i) begin_forces(static_cast<int>(i));
    if (!springs_.empty() || !any_contacts_)
        (void)begin_direct(among_ghosts() ? 0 : most_at_first(), springs_.empty());
}

void IslandSolver::part_rebounds(bool found_again) {
    const auto is_ghost = [](const BodyRows& rows) { return !rows.body->own; };
    if (!told_crossed_ || std::ranges::none_of(rows_of_, is_ghost)) return;
    const std::size_t count = found_again ? found_.size() : island_->manifolds.size();
    const auto manifold = [&](std::size_t i) -> Manifold& {
        return found_again ? found_[i] : (*manifolds_)[static_cast<std::size_t>(island_->manifolds[i])];
    };
    const auto moves = [this](int body) { return body < kFirstPlane && local(body) >= 0; };
    const auto partners = [this](int body) -> int& {
        return partners_[static_cast<std::size_t>(local(body))];
    };
    partners_.assign(rows_of_.size(), 0);
    for (std::size_t i = 0; i < count; ++i) {
        const Manifold& m = manifold(i);
        const bool again = i > 0 && manifold(i - 1).a == m.a && manifold(i - 1).b == m.b;
        if (!again && moves(m.a) && moves(m.b)) ++partners(m.a), ++partners(m.b);
    }
    for (std::size_t i = 0; i < count; ++i) {
        Manifold& m = manifold(i);
        if (!moves(m.a) || !moves(m.b) || (partners(m.a) == 1 && partners(m.b) == 1)) continue;
        const auto ghost = [&](int body) {
            return is_ghost(rows_of_[static_cast<std::size_t>(local(body))]);
        };
        if (ghost(m.a) != ghost(m.b)) m.restitution = 0;
    }
}

void IslandSolver::begin_body(BodyRows& rows) {
    MovingBody& body = *rows.body;
    rows.place = body.state.position, rows.time = 0, rows.frame = body.posed.rotation;
    rows.body_from_world = body.posed.rotation.transpose().cast<float>();
    rows.rotation = body.substep_rotation;
    rows.inverse_mass = 1 / body.kind->mass.mass;
    rows.struck = rows.stiff = false;
    if (!paths_) return;
    BodyPath& path = (*paths_)[static_cast<std::size_t>(&body - bodies_->data())];
    path.legs.clear();
    path.legs.reserve(4 * static_cast<std::size_t>(settings_->substeps));
    path.end = settings_->dt;
    path.inertia = body.kind->mass.inertia;
}

// What a block's contacts need.
IslandSolver::Part IslandSolver::part_of(std::span<const int> manifolds) const {
    Part part;
    for (const int m : manifolds) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        std::size_t width = 0;
        for (const int id : {manifold.a, manifold.b})
            if (id < kFirstPlane && local(id) >= 0)
                width += static_cast<std::size_t>(rows_of_[static_cast<std::size_t>(local(id))].width);
        const auto count = static_cast<std::size_t>(manifold.count);
        part.contacts += count, part.floats += 3 * count * width;
        part.impacts = part.impacts || manifold.points[0].begins >= 0;
    }
    return part;
}

// The contacts' rows, in the order of blocks.
void IslandSolver::add_contacts(const Island& island) {
    blocks_.divide(crew(), places_, island.manifolds, *manifolds_, local_);
    each_body([this](BodyRows& rows) { begin_body(rows); });
    sums_.assign(blocks_.slabs(), {});
    parts_.resize(blocks_.size());
    crew().each(parts_.size(), 1, [&](int, std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b) parts_[b] = part_of(blocks_.manifolds_of(b));
    });
    Part all;
    for (std::size_t b = 0; b < parts_.size(); ++b) {
        Part& part = parts_[b];
        part.contacts = std::exchange(all.contacts, all.contacts + part.contacts);
        part.floats = std::exchange(all.floats, all.floats + part.floats);
        all.impacts = all.impacts || part.impacts;
        blocks_.set_contacts(b, part.contacts, all.contacts);
    }
    std::size_t floats = all.floats;
    for (const int c : island.constraints) {
        const HeldConstraint& held = (*constraints_)[static_cast<std::size_t>(c)];
        for (const int id : {held.definition.body_a, held.definition.body_b})
            if (id >= 0 && local(id) >= 0)
                floats += 3 * static_cast<std::size_t>(held.count *
                                                       rows_of_[static_cast<std::size_t>(local(id))].width);
    }
    jacobians_.resize(floats);
    jacobians_used_ = all.floats;
    springs_.clear(), impacts_.clear(), first_contact_.clear();
    any_told_ = direct_ = any_bounce_ = any_struck_ = any_rebound_ = any_emerging_ = false;
    any_impacts_ = all.impacts;
    any_contacts_ = !island.manifolds.empty();
    first_crossed_ = crossed_.size();
    contacts_.resize(all.contacts);
    for (auto* list : {&striking_, &struck_}) list->reserve(all.contacts);
    hits_.reserve(all.contacts), contacts_of_.reserve(2 * all.contacts);
    first_contact_.reserve(rows_of_.size() + 1), hit_bodies_.reserve(rows_of_.size());
    if (any_impacts_) stiffen(island);
    windows_.resize(static_cast<std::size_t>(crew().size()));
    for (Window& window : windows_) window.next_turn.assign(rows_of_.size(), 0);
    crew().each(parts_.size(), 1, [this](int thread, std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b)
            fill_part(blocks_.manifolds_of(b), windows_[static_cast<std::size_t>(thread)], parts_[b]);
    });
    std::size_t next = 0;
    for (const Part& part : parts_) {  // `contacts`: their end by now
        note(part);
        for (; next < part.contacts; ++next)
            if (part.impacts && contacts_[next].firm) impacts_.push_back(next);
    }
    if (told_crossed_)
        for (ContactRows& c : contacts_) note_told(c);
}

void IslandSolver::note(const Part& part) noexcept {
    any_bounce_ = any_bounce_ || part.bounces;
    any_rebound_ = any_rebound_ || part.rebounds;
    any_emerging_ = any_emerging_ || part.emerging;
}

// A body that meets another so fast that its modes would yield beyond what they describe carries as if it were rigid in this step:
// its centre would run on through what it strikes. The speed: half of its thinnest half extent in the time of its slowest mode, 1 / omega.
void IslandSolver::stiffen(const Island& island) {
    for (const int m : island.manifolds) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        const ManifoldPoint& point = manifold.points[0];
        if (!(point.begins >= 0) || std::isinf(point.begins)) continue;
        auto velocity_of = [this](int id) -> Eigen::Vector3d {
            if (id >= kFirstPlane) return Eigen::Vector3d::Zero();
            return (*bodies_)[static_cast<std::size_t>(id)].state.velocity;
        };
        const double speed =
            std::abs(point.normal.cast<double>().dot(velocity_of(manifold.a) - velocity_of(manifold.b)));
        for (const int id : {manifold.a, manifold.b}) {
            if (id >= kFirstPlane || local(id) < 0) continue;
            BodyRows& rows = rows_of_[static_cast<std::size_t>(local(id))];
            const BodyKind& kind = *rows.body->kind;
            if (kind.modes > 0 &&
                speed > kGradientLimit * kind.half_box.minCoeff() * kind.basis.omega.minCoeff())
                rows.stiff = true;
        }
    }
}

// A block's contacts, by turns within windows.
void IslandSolver::fill_part(std::span<const int> manifolds, Window& window, Part& part) {
    auto turns_of = [&](int id) -> int* {
        if (id >= kFirstPlane || local(id) < 0) return nullptr;
        return &window.next_turn[static_cast<std::size_t>(local(id))];
    };
    for (const int m : manifolds) {
        Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        int* const next[] = {turns_of(manifold.a), turns_of(manifold.b)};
        for (int i = 0; i < manifold.count; ++i) {
            if (window.contacts.size() == kWindow) flush(window, part);
            int turn = 0;
            for (const int* of : next)
                if (of) turn = std::max(turn, *of);
            for (int* of : next)
                if (of) *of = turn + 1;
            window.contacts.push_back({&manifold, i, turn});
        }
    }
    flush(window, part);
}

// Adds the window's contacts by turn, each turn's in order of ids, and begins anew.
void IslandSolver::flush(Window& window, Part& part) {
    std::array<int, kWindow + 1> first{};
    std::array<const Turn*, kWindow> by_turn;
    for (const Turn& t : window.contacts) ++first[static_cast<std::size_t>(t.turn) + 1];
    for (std::size_t t = 1; t < first.size(); ++t) first[t] += first[t - 1];
    for (const Turn& t : window.contacts)
        by_turn[static_cast<std::size_t>(first[static_cast<std::size_t>(t.turn)]++)] = &t;
    for (std::size_t i = 0; i < window.contacts.size(); ++i) {
        Manifold& manifold = *by_turn[i]->manifold;
        fill_contact(contacts_[part.contacts++], manifold,
                     manifold.points[static_cast<std::size_t>(by_turn[i]->point)], part);
    }
    for (const Turn& t : window.contacts)
        for (const int id : {t.manifold->a, t.manifold->b})
            if (id < kFirstPlane && local(id) >= 0) window.next_turn[static_cast<std::size_t>(local(id))] = 0;
    window.contacts.clear();
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

IslandSolver::Side IslandSolver::reserve_rows(int body, std::size_t& used) const {
    if (body < 0) return {};
    const BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
    const Side side{body, rows.width, static_cast<std::uint32_t>(used), rows.offset};
    used += 3 * static_cast<std::size_t>(rows.width);
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
        if (rows.stiff || rows.body->at_limit) {  // what cannot yield any more carries as if it were rigid
            std::fill_n(out + 8, kind.mode_width, 0.f);
            continue;
        }
        const Eigen::Vector3f own = body_from_world * world;
        const int width = kind.mode_width;
        const float* root_compliance = of_substep(kind).root_compliance.data();
        for (int k = 0; k < width; k += kLanes)
            store_lanes(out + 8 + k, load_lanes(root_compliance + k) *
                                         (own.x() * load_lanes(place.shapes + k) +
                                          own.y() * load_lanes(place.shapes + width + k) +
                                          own.z() * load_lanes(place.shapes + 2 * width + k)));
    }
}

// Place in crossed_ of an own body's contact with a ghost, else -1.
int IslandSolver::note_pair(const Manifold& manifold) {
    if (manifold.b >= kFirstPlane || local(manifold.a) < 0 || local(manifold.b) < 0) return -1;
    const MovingBody &a = (*bodies_)[static_cast<std::size_t>(manifold.a)],
                     &b = (*bodies_)[static_cast<std::size_t>(manifold.b)];
    if (a.own == b.own) return -1;
    any_told_ = true;
    const int own = a.own ? manifold.a : manifold.b, ghost = a.own ? manifold.b : manifold.a;
    for (std::size_t i = first_crossed_; i < crossed_.size(); ++i)
        if (crossed_[i].own == own && crossed_[i].ghost == ghost) return static_cast<int>(i);
    crossed_.emplace_back(own, ghost);
    return static_cast<int>(crossed_.size()) - 1;
}

void IslandSolver::note_told(ContactRows& c) {
    c.pair = note_pair(*c.manifold);
    c.told = note_told(c, true) || c.pair >= 0;
}

// Impulses of planes and fixed bodies are not recorded: a worker with a ghost of the body computes them.
bool IslandSolver::note_told(const Rows& rows, bool contact) {
    bool watched = false, both = true;
    for (const Side& side : rows.side) {
        both = both && side.body >= 0;
        watched = watched || (side.body >= 0 && rows_of_[static_cast<std::size_t>(side.body)].body->watched);
    }
    const bool told = watched && (both || !contact);
    if (told) any_told_ = true;
    return told;
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

// In which an impact is due.
int IslandSolver::substep_of(const ManifoldPoint& point) const {
    return static_cast<int>(std::min(static_cast<double>(point.begins) * settings_->substeps / settings_->dt,
                                     settings_->substeps - 1.));
}

void IslandSolver::add_contact(Manifold& manifold, ManifoldPoint& point) {
    Part part;
    part.floats = jacobians_used_;
    fill_contact(contacts_.extend(), manifold, point, part);
    jacobians_used_ = part.floats;
    if (told_crossed_) note_told(contacts_.back());
    note(part);
    if (contacts_.back().firm) impacts_.push_back(contacts_.size() - 1), any_impacts_ = true;
}

// part: where its rows begin among jacobians_, and what it is then noted in.
void IslandSolver::fill_contact(ContactRows& c, Manifold& manifold, ManifoldPoint& point, Part& part) {
    auto moving = [this](int id) { return id < kFirstPlane ? local(id) : -1; };
    c = {};
    c.manifold = &manifold;
    c.point = &point;
    c.side[0] = reserve_rows(moving(manifold.a), part.floats);
    c.side[1] = reserve_rows(moving(manifold.b), part.floats);
    c.starts = static_cast<double>(point.begins);
    // Only what comes together rebounds, not what rests and rings.
    c.restitution = point.normal_impulse > 0 ? 0 : manifold.restitution;
    c.firm = c.starts >= 0;
    set_tangents(point.normal, c.tangent);
    write_contact(c);
    c.separation = c.now = point.separation;
    c.friction = manifold.friction;
    c.emerging = manifold.emerging;
    part.bounces = part.bounces || (c.restitution > 0 && is_rigid(c));
    part.rebounds = part.rebounds || c.restitution > 0;
    part.emerging = part.emerging || c.emerging;
    c.impulse[0] = point.normal_impulse;
    c.impulse[1] = point.friction_impulse.dot(c.tangent[0]);
    c.impulse[2] = point.friction_impulse.dot(c.tangent[1]);
    if (!c.firm) return;
    c.begins = substep_of(point);
    c.over = std::isinf(c.starts);
}

// The rows of a contact, in the bodies' frames as they are now, at the one point at which its impulses act, once it has
// begun.
void IslandSolver::write_contact(ContactRows& c) {
    alignas(32) float scratch[2][3 * kMostModes];
    const ManifoldPoint& point = *c.point;
    Eigen::Vector3f arms[2] = {point.arm_a, point.arm_b};
    if (c.side[0].body >= 0 && c.side[1].body >= 0 && c.starts < time_ + h_) {
        const Eigen::Vector3d at = place_now(c);
        for (int side = 0; side < 2; ++side)
            arms[side] = (at - rows_of_[static_cast<std::size_t>(c.side[side].body)].place).cast<float>();
    }
    const Place a = place(c.manifold->a, arms[0], point.sample_a, point.rest_a, scratch[0]);
    const Place b = place(c.manifold->b, arms[1], point.sample_b, point.rest_b, scratch[1]);
    Eigen::Matrix3f directions;
    directions << point.normal.transpose(), c.tangent[0].transpose(), c.tangent[1].transpose();
    write_rows(a, directions, 1, c.side[0]);
    write_rows(b, directions, -1, c.side[1]);
    finish_rows(c);
    see_driven(c);
    c.inverse_normal = 1 / c.k[0][0];
    c.slide_mass = 2 / (c.k[1][1] + c.k[2][2]);
    const float det = c.k[1][1] * c.k[2][2] - c.k[1][2] * c.k[1][2];
    c.inverse_tangent[0] = c.k[2][2] / det, c.inverse_tangent[1] = -c.k[1][2] / det,
    c.inverse_tangent[2] = c.k[1][1] / det;
}

void IslandSolver::add_spring(HeldConstraint& constraint, HeldPoint& point) {
    const PointConstraint& held = constraint.definition;
    SpringRows s{};
    s.point = &point, s.axes.setIdentity();
    s.impulse = point.impulse.cast<double>() / 2;  // each half, at rest
    s.place.setZero(), s.moved.setZero(), s.offset.setZero(), s.gap.setZero();
    auto local_of = [this](int body) { return body >= 0 ? local(body) : -1; };
    s.side[0] = reserve_rows(local_of(held.body_a), jacobians_used_);
    s.side[1] = reserve_rows(local_of(held.body_b), jacobians_used_);
    s.constraint = &constraint;
    s.told = note_told(s, false);
    springs_.push_back(s);
}

IslandSolver::End IslandSolver::end_of(int body, const Eigen::Vector3d& rest, float* shapes) const {
    if (body < 0) return {rest, {-1, Eigen::Vector3f::Zero(), nullptr}};
    const MovingBody& b = (*bodies_)[static_cast<std::size_t>(body)];
    const BodyKind& kind = *b.kind;
    if (b.travels) {
        const BodyPath::Pose pose = pose_of(body, now_);
        const Eigen::Vector3d arm = pose.orientation * rest;
        return {pose.position + arm, {-1, arm.cast<float>(), nullptr}};
    }
    Eigen::Vector3d point = rest;
    if (kind.modes > 0) {
        kind.shapes_at(rest.cast<float>(), shapes);
        for (int k = 0; k < kind.modes; ++k) {
            double q = b.state.q[k];
            if (modes_ahead_ && local(body) >= 0)  // under what acts so far, held over the substep
                q += h_ * of_substep(kind).held.root_compliance[k] *
                     static_cast<double>(y_.data()[rows_of_[static_cast<std::size_t>(local(body))].offset +
                                                   8 + static_cast<std::uint32_t>(k)]);
            for (int axis = 0; axis < 3; ++axis)
                point[axis] += static_cast<double>(shapes[axis * kind.mode_width + k]) * q;
        }
    }
    const Eigen::Vector3d arm = b.state.orientation * point;
    const Eigen::Vector3d& centre =
        local(body) < 0 ? b.state.position : rows_of_[static_cast<std::size_t>(local(body))].place;
    return {centre + arm, {local(body), arm.cast<float>(), kind.modes > 0 ? shapes : nullptr}};
}

Eigen::Quaterniond IslandSolver::orientation_of(int body) const {
    if (body < 0) return Eigen::Quaterniond::Identity();
    const MovingBody& b = (*bodies_)[static_cast<std::size_t>(body)];
    return b.travels ? pose_of(body, now_).orientation : b.state.orientation;
}

// Springs act over large turns, so their arms and rows follow the bodies every substep.
void IslandSolver::write_spring(SpringRows& s) {
    const PointConstraint& held = s.constraint->definition;
    alignas(32) float scratch[2][3 * kMostModes];
    const End a = end_of(held.body_a, s.point->a, scratch[0]);
    End b = end_of(held.body_b, s.point->b, scratch[1]);
    const Eigen::Quaterniond turned = orientation_of(held.body_b);
    if (s.point->turns) {
        s.axes = s.point->directions * turned.conjugate().toRotationMatrix();
        b.place.arm += (a.point - b.point).cast<float>();  // of b's matter at a's point
    }
    const Eigen::Matrix3f axes = s.axes.cast<float>();
    write_rows(a.place, axes, 1, s.side[0]);
    write_rows(b.place, axes, -1, s.side[1]);
    finish_rows(s);
    s.drift = axes * (speed_of(held.body_a, a.place.arm.cast<double>()) -
                      speed_of(held.body_b, b.place.arm.cast<double>()))
                         .cast<float>();
    s.place = s.point->turns ? a.point : Eigen::Vector3d((a.point + b.point) / 2);
    s.gap = s.point->gap(a.point, b.point, turned);
}

}  // namespace sim
