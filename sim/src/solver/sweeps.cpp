#include "solver/sweeps.h"

#include <atomic>
#include <cmath>
#include <numbers>

#include "solver/contact_kernel.h"
#include "solver/restitution.h"

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// Overlaps are pushed out as by a damped spring of the pair. [Hz], below a quarter of 1 / h; what rests sinks by
// g / (2 pi 30 Hz)^2 = 0.28 mm a body carried. Stiffer: piles simmer; softer: they sink.
constexpr double kPushHz = 30;
// Damping ratio of that spring; far above 1, so that what is pushed out does not rebound.
constexpr double kPushDamping = 10;
// [rad] A body whose frame has turned by more gets new rows. Without: a body of unequal moments of inertia that spins sees its
// old axes, and impulses turn it the wrong way.
constexpr double kFrameTurn = 0.05;

float length(float x, float y) {
    return root_of(x * x + y * y);
}

}  // namespace

Sweeps::Sweeps(IslandRows& rows, AppliedForces& forces, Impacts& impacts)
    : rows_(rows), forces_(forces), impacts_(impacts) {
    const double h = rows.whole_substep(), omega = 2 * std::numbers::pi * std::min(kPushHz, 0.25 / h);
    const double a1 = 2 * kPushDamping + h * omega, a2 = h * omega * a1;
    push_rate_ = static_cast<float>(omega / a1);
    mass_share_ = static_cast<float>(a2 / (1 + a2));
    impulse_share_ = static_cast<float>(1 / (1 + a2));
}

// Does what was put together.
void Sweeps::run() {
    rows_.blocks.run(
        rows_.crew(), static_cast<std::uint32_t>(phases_.size()),
        [this](std::uint32_t p) { return phases_[p].of_bodies; },
        [this](std::uint32_t p, const Block& block) { (this->*phases_[p].act)(block); });
    phases_.clear();
}

void Sweeps::substep(bool carried, bool last) {
    sums_.assign(rows_.blocks.slabs(), {});
    rows_.substep.begins = rows_.substep.now = rows_.substep.number * rows_.substep.h;
    forces_.set();
    if (carried) contacts(&Sweeps::follow_motions);
    if (rows_.substep.number > 0 && rows_.any_contacts)
        bodies(&Sweeps::turn_frames), contacts(&Sweeps::turn_rows);
    bodies(&Sweeps::load);
    if (rows_.any_bounce || rows_.any_impacts || !rows_.springs.empty()) {
        run();
        if (rows_.any_bounce || rows_.any_impacts) impacts_.strike();
        pull_springs();
    }
    contacts(&Sweeps::warm_start);
    contacts(&Sweeps::sweep<Push::soft>);
    pushes_out_ = false;
    if (rows_.any_emerging) run(), pushes_out_ = may_push_out();
    if (pushes_out_) bodies(&Sweeps::keep), contacts(&Sweeps::sweep<Push::all>);
    contacts(&Sweeps::give_to_move);
    bodies(&Sweeps::move);
    if (!rows_.springs.empty()) {
        run();
        rows_.modes_ahead = true;
        pull_springs();
        rows_.modes_ahead = false;
    }
    if (pushes_out_ || rows_.any_rebound || rows_.any_impacts) contacts(&Sweeps::follow_rows);
    contacts(&Sweeps::sweep<Push::none>);
    contacts(&Sweeps::sweep<Push::none>);
    if (rows_.any_rebound) contacts(&Sweeps::note_works);
    if (rows_.any_rebound && last) contacts(&Sweeps::rebound);
    contacts(&Sweeps::give_the_rest);
    bodies(&Sweeps::finish);
    run();
    forces_.count(1);
    take_sums();
}

void Sweeps::follow_motions(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) rows_.see_driven(c);
}

// Frames follow bodies that turned, with what is written in them: rows, and the way so far. Rows of contacts that rebound
// follow the place where they act, too.
void Sweeps::turn_frames(const Block& slab) {
    for (const std::uint32_t body : rows_.blocks.bodies_of(slab.slab)) {
        BodyRows& rows = rows_.bodies[body];
        rows.turned = false;
        const Eigen::Vector3d& root = rows.body->kind->root_inertia;
        if (root.maxCoeff() - root.minCoeff() < 1e-6 * root.maxCoeff()) continue;  // alike in all frames
        const Eigen::Matrix3d now = rows.body->state.orientation.toRotationMatrix();
        if ((now - rows.frame).squaredNorm() < 2 * kFrameTurn * kFrameTurn) continue;
        rows.turned = true;
        rows_.turn_frame(rows, now);
    }
}

void Sweeps::turn_rows(const Block& block) {
    auto has_turned = [this](const RowSide& side) {
        return side.body >= 0 && rows_.bodies[static_cast<std::size_t>(side.body)].turned;
    };
    for (ContactRows& c : rows_.contacts_in(block))
        if (rows_.follows(c) || has_turned(c.side[0]) || has_turned(c.side[1])) rows_.write_contact(c);
}

void Sweeps::load(const Block& slab) {
    for (const std::uint32_t body : rows_.blocks.bodies_of(slab.slab))
        rows_.load_velocities(rows_.bodies[body]);
}

// The first sweep.
void Sweeps::warm_start(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) {
        warm_start(c);
        if (rows_.any_struck) impacts_.stretch_gap(c);
    }
}

void Sweeps::warm_start(ContactRows& c) {
    // Approach speeds first, before any impulse: gravity's share of this substep included, as it is real.
    float speed = 0, moved = 0;
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const float* d = rows_.jacobians.data() + side.rows;
        if (c.restitution > 0 && c.largest == 0) speed += dot(d, rows_.start.data() + side.y, side.width);
        if (rows_.substep.number > 0 || rows_.any_struck)
            moved += dot(d, rows_.moved.data() + side.y, side.width);
    }
    if (c.restitution > 0 && c.largest == 0) speed += c.drift[0];
    if (c.largest == 0) c.approach = speed;
    c.now = c.separation + moved + c.drifted;
    if (c.impulse[0] != 0) push_by(rows_, c, c.impulse);
}

// Positions move with velocities that also push emerging bodies out; the velocities themselves never see it.
bool Sweeps::may_push_out() const {
    std::atomic<bool> any = false;
    rows_.crew().each(rows_.contacts.size(), 64, [&](int, std::size_t first, std::size_t last) {
        for (const ContactRows& c : std::span(rows_.contacts).subspan(first, last - first))
            if (c.emerging && c.now < 0) any.store(true, std::memory_order_relaxed);
    });
    return any;
}

void Sweeps::keep(const Block& slab) {
    for (const std::uint32_t body : rows_.blocks.bodies_of(slab.slab)) {
        const BodyRows& rows = rows_.bodies[body];
        std::copy_n(rows_.y.data() + rows.offset, rows.width, rows_.kept.data() + rows.offset);
    }
}

template <Sweeps::Push kPush>
void Sweeps::sweep(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) {
        if (kPush == Push::all) std::copy_n(c.impulse, 3, c.kept);
        if (c.begins >= rows_.substep.number || c.over) continue;
        // Selected, not branched: which case it is cannot be foretold.
        const bool soft = c.now <= 0 && (kPush == Push::all || (kPush == Push::soft && !c.emerging));
        const float bias = c.now > 0 ? c.now * rows_.substep.inverse_h
                           : soft    ? std::max(push_rate_ * c.now, -kPushSpeed)
                                     : 0;
        // What an impact left is stopped at once: what yields for a substep lets it far in.
        const bool yields = soft && !c.firm;
        solve_contact(rows_, c, bias, yields ? mass_share_ : 1, yields ? impulse_share_ : 0);
    }
}

void Sweeps::give_to_move(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) {
        std::copy_n(c.impulse, 3, c.at_move);
        c.drifted += static_cast<float>(rows_.substep.h) * c.drift[0];
        rows_.apply(c, c.at_move, sums_[block.slab].outside);
    }
}

void Sweeps::move(const Block& slab) {
    for (const std::uint32_t body : rows_.blocks.bodies_of(slab.slab)) {
        const BodyRows& rows = rows_.bodies[body];
        move(rows_.bodies[body]);
        if (pushes_out_)
            std::copy_n(rows_.kept.data() + rows.offset, rows.width, rows_.y.data() + rows.offset);
    }
}

void Sweeps::move(BodyRows& rows) {
    MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    const float* y = rows_.y.data() + rows.offset;
    float* moved = rows_.moved.data() + rows.offset;
    const double left = rows_.substep.h - rows.time;
    const float h = static_cast<float>(rows_.substep.h), rigid = static_cast<float>(left);
    for (int i = 0; i < rows.width; ++i) moved[i] += (i < 8 ? rigid : h) * y[i];
    WorldBodyState& s = body.state;
    const Eigen::Vector3d velocity = s.velocity + rows_.velocity_given(body, rows_.substep.h),
                          momentum = s.angular_momentum + rows_.momentum_given(body, rows_.substep.h);
    rows_.write_leg(rows, velocity, momentum);
    s.position = rows.place += left * velocity;
    s.orientation = rows.time > 0 ? rotate_freely(s.orientation, momentum, kind.mass.inertia, left)
                                  : body.substep_rotation.advance(s.orientation, momentum);
}

void Sweeps::follow_rows(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) {
        if (pushes_out_) std::copy_n(c.kept, 3, c.impulse);
        if (rows_.follows(c)) rows_.write_contact(c);
    }
}

// Energy that a contact's normal impulse takes out in this substep, where it may have to give some back: held
// over the substep, it does p (v0 + v1) / 2 on the rigid part and p G on the modes.
void Sweeps::note_works(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) note_work(rows_, c, c.impulse[0]);
}

// A rebound to e times the approach, by an impulse p whose work p v + p^2 (K_rigid / 2 + K_modes) is at most
// e^2 of the energy that the contact has taken. For rigid bodies both say the same.
void Sweeps::rebound(const Block& block) {
    for (ContactRows& c : rows_.contacts_in(block)) restitute(rows_, c);
}

void Sweeps::give_the_rest(const Block& block) {
    for (const ContactRows& c : rows_.contacts_in(block)) {
        const float after[3] = {c.impulse[0] - c.at_move[0], c.impulse[1] - c.at_move[1],
                                c.impulse[2] - c.at_move[2]};
        rows_.apply(c, after, sums_[block.slab].outside);
    }
}

void Sweeps::finish(const Block& slab) {
    for (const std::uint32_t body : rows_.blocks.bodies_of(slab.slab))
        finish(rows_.bodies[body], sums_[slab.slab]);
}

void Sweeps::finish(const BodyRows& rows, Sums& sums) {
    MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    WorldBodyState& s = body.state;
    const Eigen::Vector3d entered = s.velocity;
    s.velocity += rows_.substep.h * body.gravity_scale * rows_.settings.gravity;
    s.velocity *= rows_.of_substep(kind).drag, s.angular_momentum *= rows_.of_substep(kind).drag;
    if (body.own) sums.outside += kind.mass.mass * (s.velocity - entered);
    if (body.pushed) {
        s.velocity += rows_.substep.h / kind.mass.mass * body.force;
        s.angular_momentum += rows_.substep.h * body.torque;
    }
    sums.limited += rows_.step_modes(rows);
}

// In the order of slabs.
void Sweeps::take_sums() {
    for (Sums& sums : sums_) {
        rows_.outside += std::exchange(sums.outside, Eigen::Vector3d::Zero());
        rows_.limited += std::exchange(sums.limited, 0);
    }
}

// Their forces where nothing holds, over half of a substep: once before the bodies move, once after, before what contacts
// do to velocities (velocity Verlet).
void Sweeps::pull_springs() {
    const double half = rows_.substep.h / 2;
    for (SpringRows& s : rows_.springs) {
        rows_.write_spring(s);
        const PointConstraint& held = s.constraint->definition;
        const double own = mobility_of(s);
        float v[3];
        speeds(rows_, s, v);
        const Eigen::Vector3d speed(v[0], v[1], v[2]);
        s.moved = s.impulse;  // both halves: of a substep
        s.impulse = -half * held.stiffness * s.gap -
                    2 * held.damping_ratio * half * std::sqrt(held.stiffness / own) * speed;
        const float p[3] = {float(s.impulse[0]), float(s.impulse[1]), float(s.impulse[2])};
        push_by(rows_, s, p);
        const Eigen::Vector3d impulse = rows_.in_world(s, s.impulse);
        if (s.recorded) rows_.cross.record(s, -1, impulse, p, s.place);
        rows_.apply(s, impulse, s.place, rows_.outside);
    }
}

// By how much speeds miss what contacts demand, at most [m/s]: the change of the impulses that would satisfy a
// contact alone, as a speed.
double Sweeps::residual() const {
    std::atomic<float> worst = 0;
    rows_.crew().each(rows_.contacts.size(), 64, [&](int, std::size_t first, std::size_t last) {
        float most = 0;
        for (std::size_t i = first; i < last; ++i) most = std::max(most, residual(rows_.contacts[i]));
        for (float now = worst; now < most && !worst.compare_exchange_weak(now, most);) {
        }
    });
    return worst;
}

float Sweeps::residual(const ContactRows& c) const {
    float v[3];
    speeds(rows_, c, v);
    if (c.restitution > 0 && c.largest > 0) return 0;
    const float bias = c.now > 0 ? c.now * rows_.substep.inverse_h : 0;
    const float normal = std::max(c.impulse[0] - c.inverse_normal * (v[0] + bias), 0.f);
    float t[2] = {c.impulse[1] - c.slide_mass * v[1], c.impulse[2] - c.slide_mass * v[2]};
    const float along = length(t[0], t[1]), most = c.friction * c.impulse[0];
    if (along > most) t[0] *= most / along, t[1] *= most / along;
    return std::max(std::abs(normal - c.impulse[0]) * c.k[0][0],
                    length(t[0] - c.impulse[1], t[1] - c.impulse[2]) / c.slide_mass);
}

}  // namespace sim
