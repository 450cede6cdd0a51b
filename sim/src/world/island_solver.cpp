#include "world/island_solver.h"

#include <algorithm>
#include <cmath>

#include "world/row_kernels.h"

namespace sim {
namespace {

using ModeArray = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMostModes, 1>;  // on the stack

// Energy in a step, of the motion's and of weight times size, beyond which a direct solution is worse than sweeps.
constexpr double kWorse = 3e-3;

// Without the library's check for negative arguments.
float root(float x) {
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x)));
}

float length(float x, float y) {
    return root(x * x + y * y);
}

}  // namespace

void IslandSolver::solve(const Island& island, const ContactScene& scene, bool follow) {
    scene_ = &scene, island_ = &island, follow_ = follow;
    carried_ = is_carried(island);
    begin(island);
    note_start();
    if (follow) start_following();
    advance();
    const bool uneven = !direct_ && is_uneven();
    const double most = uneven ? most_with_springs() : most_with_contacts();
    if (!direct_ && (uneven || is_far_from_solved()) && begin_direct(most)) {
        // Of contacts that contradict each other the exact answer is worse than sweeps that give up: where nothing
        // else may give energy, it shows by that.
        const double swept = energy(true);
        go_back();
        begin_direct(most);
        note_start();
        advance();
        const double gained = energy(true) - std::max(swept, energy_before_);
        if (!may_gain() && !(gained < kWorse * scale_)) go_back(), note_start(), advance();
    }
    // Joints alone give back what they take, within a step or over several.
    if (!may_gain() && !any_told_ && (springs_.empty() || !island.manifolds.empty()))
        (void)calm(energy(direct_));
    end_forces();
    keep_impulses();
    for (const int id : island_->bodies) local_[static_cast<std::size_t>(id)] = -1;
}

void IslandSolver::advance() {
    for (int i = 0; i < settings_->substeps; ++i) {
        remaining_ = h_ * (settings_->substeps - 1 - i);
        substep_ = i, gone_ = 0;
        const bool last = i + 1 == settings_->substeps;
        direct_ ? direct_substep(0, last) : substep(last);
    }
}

bool IslandSolver::may_gain() const {
    return carried_ || std::ranges::any_of(rows_of_, [](const BodyRows& rows) { return rows.body->pushed; });
}

bool IslandSolver::is_far_from_solved() const {
    return !any_impacts_ && !any_struck_ && !among_ghosts() &&
           residual() > kMissedAtRest * smallest_ + kMissedShare * fastest_;
}

// Whether bodies touch much lighter ones, nothing else.
bool IslandSolver::is_uneven() const {
    if (any_impacts_ || any_struck_ || among_ghosts()) return false;
    std::atomic<bool> uneven = false;
    crew().each(contacts_.size(), 64, [&](int, std::size_t first, std::size_t last) {
        for (const ContactRows& c : std::span(contacts_).subspan(first, last - first)) {
            if (c.side[0].body < 0 || c.side[1].body < 0) continue;
            auto mass = [&](int side) {
                return rows_of_[static_cast<std::size_t>(c.side[side].body)].body->kind->mass.mass;
            };
            if (std::max(mass(0) / mass(1), mass(1) / mass(0)) > kUneven)
                uneven.store(true, std::memory_order_relaxed);
        }
    });
    return uneven;
}

// By how much speeds miss what contacts demand, at most [m/s]: the change of the impulses that would satisfy a
// contact alone, as a speed.
double IslandSolver::residual() const {
    std::atomic<float> worst = 0;
    crew().each(contacts_.size(), 64, [&](int, std::size_t first, std::size_t last) {
        float most = 0;
        for (std::size_t i = first; i < last; ++i) most = std::max(most, residual(contacts_[i]));
        for (float now = worst; now < most && !worst.compare_exchange_weak(now, most);) {
        }
    });
    return worst;
}

float IslandSolver::residual(const ContactRows& c) const {
    float v[3];
    speeds(c, v);
    if (c.restitution > 0 && c.largest > 0) return 0;
    const float bias = c.now > 0 ? c.now * inverse_h_ : 0;
    const float normal = std::max(c.impulse[0] - c.inverse_normal * (v[0] + bias), 0.f);
    float t[2] = {c.impulse[1] - c.slide_mass * v[1], c.impulse[2] - c.slide_mass * v[2]};
    const float along = length(t[0], t[1]), most = c.friction * c.impulse[0];
    if (along > most) t[0] *= most / along, t[1] *= most / along;
    return std::max(std::abs(normal - c.impulse[0]) * c.k[0][0],
                    length(t[0] - c.impulse[1], t[1] - c.impulse[2]) / c.slide_mass);
}

// Does what was put together.
void IslandSolver::run() {
    blocks_.run(
        crew(), static_cast<std::uint32_t>(phases_.size()),
        [this](std::uint32_t p) { return phases_[p].of_bodies; },
        [this](std::uint32_t p, const IslandBlocks::Block& block) { (this->*phases_[p].act)(block); });
    phases_.clear();
}

void IslandSolver::substep(bool last) {
    using Solver = IslandSolver;
    begin_times(substep_ * h_);
    set_forces();
    if (carried_) contacts(&Solver::see_driven);
    if (substep_ > 0 && any_contacts_) bodies(&Solver::turn_frames), contacts(&Solver::turn_rows);
    bodies(&Solver::load_velocities);
    if (any_bounce_ || any_impacts_ || !springs_.empty()) {
        run();
        if (any_bounce_ || any_impacts_) strike();
        pull_springs();
    }
    contacts(&Solver::warm_start);
    contacts(&Solver::sweep<Push::soft>);
    pushes_out_ = false;
    if (any_emerging_) run(), pushes_out_ = may_push_out();
    if (pushes_out_) bodies(&Solver::keep), contacts(&Solver::sweep<Push::all>);
    contacts(&Solver::give_to_move);
    bodies(&Solver::move);
    if (!springs_.empty()) {
        run();
        modes_ahead_ = true;
        pull_springs();
        modes_ahead_ = false;
    }
    if (pushes_out_ || any_rebound_ || any_impacts_) contacts(&Solver::follow_rows);
    contacts(&Solver::sweep<Push::none>);
    contacts(&Solver::sweep<Push::none>);
    if (any_rebound_) contacts(&Solver::note_work);
    if (any_rebound_ && last) contacts(&Solver::restitute);
    contacts(&Solver::give_the_rest);
    bodies(&Solver::finish);
    run();
    count_forces(1);
    take_sums();
}

void IslandSolver::see_driven(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) see_driven(c);
}

void IslandSolver::load_velocities(const IslandBlocks::Block& slab) {
    for (const std::uint32_t body : blocks_.bodies_of(slab.slab)) load_velocities(rows_of_[body]);
}

void IslandSolver::load_velocities(BodyRows& rows) {
    const MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    const WorldBodyState& s = body.state;
    rows.place = s.position, rows.time = 0;
    if (!any_contacts_) {
        rows.frame = s.orientation.toRotationMatrix();
        rows.body_from_world = rows.frame.transpose().cast<float>();
    }
    const Eigen::Matrix3d& frame = rows.frame;
    const Eigen::Vector3d velocity = s.velocity + velocity_given(body, h_),
                          momentum = s.angular_momentum + momentum_given(body, h_);
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
    const HeldSteps& step = of_substep(kind).held;
    Eigen::Map<Eigen::ArrayXf> mean(y + 8, kind.modes);
    mean =
        ((step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array()) / step.root_compliance).cast<float>();
    if (body.pushed) mean += (step.root_compliance * h_ * body.modal_force.array()).cast<float>();
    for (int k = kind.modes; k < kind.mode_width; ++k) y[8 + k] = 0;
    std::copy_n(y, rows.width, y_.data() + rows.offset);
}

// The first sweep.
void IslandSolver::warm_start(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) {
        warm_start(c);
        if (any_struck_) stretch_gap(c);
    }
}

void IslandSolver::warm_start(ContactRows& c) {
    // Approach speeds first, before any impulse: gravity's share of this substep included, as it is real.
    float speed = 0, moved = 0;
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const float* d = jacobians_.data() + side.rows;
        if (c.restitution > 0 && c.largest == 0) speed += dot(d, start_.data() + side.y, side.width);
        if (substep_ > 0 || any_struck_) moved += dot(d, moved_.data() + side.y, side.width);
    }
    if (c.restitution > 0 && c.largest == 0) speed += c.drift[0];
    if (c.largest == 0) c.approach = speed;
    c.now = c.separation + moved + c.drifted;
    if (c.impulse[0] != 0) push_by(c, c.impulse);
}

// Positions move with velocities that also push emerging bodies out; the velocities themselves never see it.
bool IslandSolver::may_push_out() {
    std::atomic<bool> any = false;
    crew().each(contacts_.size(), 64, [&](int, std::size_t first, std::size_t last) {
        for (const ContactRows& c : std::span(contacts_).subspan(first, last - first))
            if (c.emerging && c.now < 0) any.store(true, std::memory_order_relaxed);
    });
    return any;
}

void IslandSolver::keep(const IslandBlocks::Block& slab) {
    for (const std::uint32_t body : blocks_.bodies_of(slab.slab)) {
        const BodyRows& rows = rows_of_[body];
        std::copy_n(y_.data() + rows.offset, rows.width, kept_.data() + rows.offset);
    }
}

template <IslandSolver::Push kPush>
void IslandSolver::sweep(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) {
        if (kPush == Push::all) std::copy_n(c.impulse, 3, c.kept);
        if (c.begins < substep_ && !c.over) solve_contact(c, kPush);
    }
}

// What the rows see of the velocities.
[[gnu::always_inline]] inline void IslandSolver::speeds(const Rows& rows, float (&v)[3]) const {
    Lanes sum[3] = {lanes_of(0), lanes_of(0), lanes_of(0)};
    for (const Side& side : rows.side)
        if (side.body >= 0) dot_rows(jacobians_.data() + side.rows, y_.data() + side.y, side.width, sum);
    for (int r = 0; r < 3; ++r) v[r] = sum_of(sum[r]) + rows.drift[r];
}

[[gnu::always_inline]] inline void IslandSolver::push_by(const Rows& rows, const float (&impulse)[3]) {
    for (const Side& side : rows.side)
        if (side.body >= 0)
            add_rows_to(jacobians_.data() + side.rows, impulse, side.width, y_.data() + side.y);
}

void IslandSolver::solve_contact(ContactRows& c, Push push) {
    float v[3];
    speeds(c, v);
    // Selected, not branched: which case it is cannot be foretold.
    const bool hit = c.striking,
               soft = !hit && c.now <= 0 && (push == Push::all || (push == Push::soft && !c.emerging));
    const float bias = hit         ? c.bias
                       : c.now > 0 ? c.now * inverse_h_
                       : soft      ? std::max(push_rate_ * c.now, -kPushSpeed)
                                   : 0;
    // What an impact left is stopped at once: what yields for a substep lets it far in.
    const bool yields = soft && !c.firm;
    const float mass_share = yields ? mass_share_ : 1, impulse_share = yields ? impulse_share_ : 0;
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
void IslandSolver::note_work(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) note_work(c, c.impulse[0]);
}

void IslandSolver::note_work(ContactRows& c, float impulse) {
    if (c.restitution == 0 || c.largest == 0) return;
    float mean = c.drift[0];
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const float* d = jacobians_.data() + side.rows;
        const float *before = start_.data() + side.y, *after = y_.data() + side.y;
        mean += (dot(d, before, 8) + dot(d, after, 8)) / 2;
        if (side.width > 8) mean += dot(d + 8, after + 8, side.width - 8);
    }
    c.taken -= impulse * mean;
}

// A rebound to e times the approach, by an impulse p whose work p v + p^2 (K_rigid / 2 + K_modes) is at most
// e^2 of the energy that the contact has taken. For rigid bodies both say the same.
void IslandSolver::restitute(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) restitute(c);
}

void IslandSolver::restitute(ContactRows& c) {
    if (c.restitution == 0 || c.largest == 0 || c.approach >= -least_bounce(c)) return;
    if (!direct_ && is_rigid(c)) return;  // impacts did
    if (c.pair >= 0) crossed_[static_cast<std::size_t>(c.pair)].blow = true;
    float v[3];
    speeds(c, v);
    float rigid = 0, slope = v[0];
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const float *d = jacobians_.data() + side.rows, *y = y_.data() + side.y,
                    *start = start_.data() + side.y;
        rigid += dot(d, d, 8);
        // The modes yield to p under all impulses of this substep, too.
        if (side.width > 8)
            slope += dot(d + 8, y + 8, side.width - 8) - dot(d + 8, start + 8, side.width - 8);
    }
    const float modes = c.k[0][0] - rigid, firm = rigid / 2 + modes;
    const float budget = c.restitution * c.restitution * std::max(c.taken, 0.f);
    const float most = (std::sqrt(slope * slope + 4 * firm * budget) - slope) / (2 * firm);
    const float wanted = -c.inverse_normal * (v[0] + c.restitution * c.approach);
    const float p[3] = {std::clamp(wanted, 0.f, std::max(most, 0.f)), 0, 0};
    c.impulse[0] += p[0];
    push_by(c, p);
}

void IslandSolver::give_to_move(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) {
        std::copy_n(c.impulse, 3, c.at_move);
        c.drifted += static_cast<float>(h_) * c.drift[0];
        apply(c, c.at_move, sums_[block.slab].outside);
    }
}

void IslandSolver::move(const IslandBlocks::Block& slab) {
    for (const std::uint32_t body : blocks_.bodies_of(slab.slab)) {
        const BodyRows& rows = rows_of_[body];
        move(rows_of_[body]);
        if (pushes_out_) std::copy_n(kept_.data() + rows.offset, rows.width, y_.data() + rows.offset);
    }
}

void IslandSolver::follow_rows(const IslandBlocks::Block& block) {
    for (ContactRows& c : contacts_in(block)) {
        if (pushes_out_) std::copy_n(c.kept, 3, c.impulse);
        if (follows(c)) write_contact(c);
    }
}

void IslandSolver::move(BodyRows& rows) {
    MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    const float* y = y_.data() + rows.offset;
    float* moved = moved_.data() + rows.offset;
    const double left = h_ - rows.time;
    const float h = static_cast<float>(h_), rigid = static_cast<float>(left);
    for (int i = 0; i < rows.width; ++i) moved[i] += (i < 8 ? rigid : h) * y[i];
    WorldBodyState& s = body.state;
    const Eigen::Vector3d velocity = s.velocity + velocity_given(body, h_),
                          momentum = s.angular_momentum + momentum_given(body, h_);
    if (paths_) write_leg(rows, velocity, momentum);
    s.position = rows.place += left * velocity;
    s.orientation = rows.time > 0 ? rotate_freely(s.orientation, momentum, kind.mass.inertia, left)
                                  : body.substep_rotation.advance(s.orientation, momentum);
}

// In the order of slabs.
void IslandSolver::take_sums() {
    for (Sums& sums : sums_) {
        outside_ += std::exchange(sums.outside, Eigen::Vector3d::Zero());
        limited_ += std::exchange(sums.limited, 0);
    }
}

void IslandSolver::forget_crossed(int body) {
    std::erase_if(crossed_, [body](const CrossImpulse& c) { return c.own == body || c.ghost == body; });
}

void IslandSolver::add_crossed(const CrossImpulse& more) {
    const auto found = std::ranges::find_if(
        crossed_, [&](const CrossImpulse& c) { return c.own == more.own && c.ghost == more.ghost; });
    if (found == crossed_.end()) return crossed_.push_back(more);
    found->blow = found->blow || more.blow;
    found->linear += more.linear;
    found->angular_own += more.angular_own, found->angular_ghost += more.angular_ghost;
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
void IslandSolver::apply(const Rows& rows, const Eigen::Vector3d& impulse, const Eigen::Vector3d& point,
                         Eigen::Vector3d& outside) {
    const Side &a = rows.side[0], &b = rows.side[1];
    if (b.body < 0 && rows_of_[static_cast<std::size_t>(a.body)].body->own) outside += impulse;
    if (a.body < 0 && rows_of_[static_cast<std::size_t>(b.body)].body->own) outside -= impulse;
    for (const Side& side : rows.side) {
        if (side.body < 0) continue;
        const BodyRows& at = rows_of_[static_cast<std::size_t>(side.body)];
        WorldBodyState& s = at.body->state;
        const Eigen::Vector3d p = &side == &rows.side[0] ? impulse : Eigen::Vector3d(-impulse);
        s.velocity += at.inverse_mass * p;
        s.angular_momentum += (point - at.place).cross(p);
    }
}

// Adds what a row triple gave: to what the worlds of both bodies tell each other, or to what the owner of one tells.
void IslandSolver::tell(const Rows& rows, int pair, const Eigen::Vector3d& impulse, const float (&along)[3],
                        const Eigen::Vector3d& point) {
    for (int which = 0; which < 2; ++which) {
        const Side& side = rows.side[which];
        if (side.body < 0) continue;
        const BodyRows& at = rows_of_[static_cast<std::size_t>(side.body)];
        MovingBody& body = *at.body;
        const Eigen::Vector3d p = which == 0 ? impulse : Eigen::Vector3d(-impulse);
        const Eigen::Vector3d turn = (point - at.place).cross(p);
        if (pair >= 0) {
            CrossImpulse& cross = crossed_[static_cast<std::size_t>(pair)];
            if (body.own) cross.linear += p;
            (body.own ? cross.angular_own : cross.angular_ghost) += turn;
            continue;
        }
        if (!body.watched) continue;
        if (!std::exchange(body.was_given, true)) body.given.set_zero();
        body.given.linear += p;
        body.given.angular += turn;
        const float* d = jacobians_.data() + side.rows + 8;
        const HeldSteps& step = of_substep(*body.kind).held;
        for (int k = 0; k < body.kind->modes; ++k)
            body.given.modal[k] += static_cast<double>(along[0] * d[k] + along[1] * d[side.width + k] +
                                                       along[2] * d[2 * side.width + k]) /
                                   step.root_compliance[k];
    }
}

// A contact's impulse (of it what moves its bodies), at the place where it is now.
[[gnu::flatten]] void IslandSolver::apply(const ContactRows& c, const float (&impulse)[3],
                                          Eigen::Vector3d& outside) {
    if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) return;
    const Eigen::Vector3d p =
        (impulse[0] * c.point->normal + impulse[1] * c.tangent[0] + impulse[2] * c.tangent[1]).cast<double>();
    const Eigen::Vector3d place = place_now(c);
    if (c.told) tell(c, c.pair, p, impulse, place);
    apply(c, p, place, outside);
}

void IslandSolver::give_the_rest(const IslandBlocks::Block& block) {
    for (const ContactRows& c : contacts_in(block)) {
        const float after[3] = {c.impulse[0] - c.at_move[0], c.impulse[1] - c.at_move[1],
                                c.impulse[2] - c.at_move[2]};
        apply(c, after, sums_[block.slab].outside);
    }
}

void IslandSolver::finish(const IslandBlocks::Block& slab) {
    for (const std::uint32_t body : blocks_.bodies_of(slab.slab)) finish(rows_of_[body], sums_[slab.slab]);
}

void IslandSolver::finish(const BodyRows& rows, Sums& sums) {
    MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    WorldBodyState& s = body.state;
    const Eigen::Vector3d entered = s.velocity;
    s.velocity += h_ * body.gravity_scale * settings_->gravity;
    s.velocity *= of_substep(kind).drag, s.angular_momentum *= of_substep(kind).drag;
    if (body.own) sums.outside += kind.mass.mass * (s.velocity - entered);
    if (body.pushed) {
        s.velocity += h_ / kind.mass.mass * body.force;
        s.angular_momentum += h_ * body.torque;
    }
    sums.limited += step_modes(rows);
}

// The modes under what the rows gave them, held over the substep.
bool IslandSolver::step_modes(const BodyRows& rows) {
    MovingBody& body = *rows.body;
    const HeldSteps& step = of_substep(*body.kind).held;
    WorldBodyState& s = body.state;
    const Eigen::Map<const Eigen::ArrayXf> now(y_.data() + rows.offset + 8, body.kind->modes),
        before(start_.data() + rows.offset + 8, body.kind->modes);
    ModeArray held = (now.cast<double>() - before.cast<double>()) / step.root_compliance;
    if (body.pushed) held += h_ * body.modal_force.array();
    const ModeArray mean =
        step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array() + step.compliance * held;
    s.q_dot.array() = step.c * s.q.array() + step.d * s.q_dot.array() + step.rate * held;
    s.q.array() += h_ * mean;
    return limit_deformation(body);
}

void IslandSolver::keep_impulse(const ContactRows& c, ManifoldPoint& point) {
    point.normal_impulse = c.impulse[0];
    point.friction_impulse = c.impulse[1] * c.tangent[0] + c.impulse[2] * c.tangent[1];
}

void IslandSolver::keep_impulses() {
    each_contact([](const ContactRows& c) { keep_impulse(c, *c.point); });
    for (const SpringRows& s : springs_) {
        s.point->impulse = (s.moved + s.impulse).cast<float>();
        const double force = s.point->impulse.norm() / h_;
        if (!s.constraint->holds || !(force > s.constraint->definition.breaking_force)) continue;
        s.constraint->holds = false;
        ++broken_;
    }
}

}  // namespace sim
