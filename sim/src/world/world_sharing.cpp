#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

// What several worlds of the same bodies, each of which owns some, need of a World.

namespace sim {
namespace {

void push(MovingBody& body, double dt, const StepImpulse& impulse) {
    if (!std::exchange(body.pushed, true))
        body.force.setZero(), body.torque.setZero(), body.modal_force.setZero();
    body.force += impulse.linear / dt;
    body.torque += impulse.angular / dt;
    if (impulse.modal.size() == body.modal_force.size()) body.modal_force += impulse.modal / dt;
}

ContactRecord record_of(const Manifold& m) {
    ContactRecord record;
    record.a = m.a, record.b = m.b, record.emerging = m.emerging, record.count = m.count;
    for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) {
        const ManifoldPoint& p = m.points[i];
        record.points[i] = {p.feature, p.arm_a, p.normal_impulse, p.friction_impulse};
    }
    return record;
}

Manifold manifold_of(const ContactRecord& record) {
    Manifold m;
    m.a = record.a, m.b = record.b, m.emerging = record.emerging, m.count = record.count;
    for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) {
        ManifoldPoint& p = m.points[i];
        p.feature = record.points[i].feature, p.arm_a = record.points[i].arm_a;
        p.normal_impulse = record.points[i].normal_impulse,
        p.friction_impulse = record.points[i].friction_impulse;
    }
    return m;
}

int first_mover(const std::vector<MovingBody>& bodies, const PointConstraint& c) {
    return !bodies[static_cast<std::size_t>(c.body_a)].fixed || c.body_b < 0 ? c.body_a : c.body_b;
}

}  // namespace

void World::Implementation::gather_pairs() {
    std::sort(placed.begin(), placed.end());
    here.clear();
    std::merge(owned.begin(), owned.end(), placed.begin(), placed.end(), std::back_inserter(here));
    std::erase_if(here, [this](int i) { return bodies[static_cast<std::size_t>(i)].quarantined; });
}

void World::Implementation::dismiss_ghosts() {
    for (const int i : placed) bodies[static_cast<std::size_t>(i)].pushed = false;
    placed.clear();
    for (const int i : arrived) bodies[static_cast<std::size_t>(i)].arrived = false;
    arrived.clear();
}

void World::share(Sharing sharing) {
    implementation_->sharing = sharing;
    implementation_->all_whole = false;
    implementation_->list_owned();
}

void World::Implementation::list_owned() {
    owned.clear();
    if (sharing != Sharing::pairs) return;
    for (std::size_t i = 0; i < bodies.size(); ++i)
        if (bodies[i].own || bodies[i].fixed) owned.push_back(static_cast<int>(i));
}

void World::set_own(int body, bool own) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    if (b.own == own) return;
    b.own = own;
    implementation_->all_whole = false;
    b.watched = b.was_given = b.pushed = false;
    b.arrived = own;
    if (own) implementation_->arrived.push_back(body);
    implementation_->list_owned();
}

bool World::own(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).own;
}

void World::record(int body, WorldRecord& out) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    out.body = body, out.state = b.state;
    out.asleep = b.asleep, out.quarantined = b.quarantined, out.at_limit = b.at_limit;
    out.still_steps = static_cast<std::uint16_t>(b.still_steps), out.sleep_group = b.sleep_group;
}

WorldRecord World::record(int body) const {
    WorldRecord record;
    this->record(body, record);
    return record;
}

void World::restore(const WorldRecord& record) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(record.body));
    b.state = record.state;
    implementation_->all_whole = false;
    b.asleep = record.asleep, b.at_limit = record.at_limit;
    b.still_steps = record.still_steps, b.sleep_group = record.sleep_group;
    b.pushed = b.was_given = false;
    b.unposed = true;
    if (record.quarantined && !b.quarantined) implementation_->drop_constraints(record.body);
    b.quarantined = record.quarantined;
}

void World::contact_records(std::vector<ContactRecord>& out) const {
    const auto& bodies = implementation_->bodies;
    out.clear();
    for (Manifold& m : implementation_->contacts.manifolds()) {
        const int first = bodies[static_cast<std::size_t>(m.a)].fixed ? m.b : m.a;
        if (!bodies[static_cast<std::size_t>(first)].own) continue;
        out.push_back(record_of(m));
    }
}

SpringRecord World::Implementation::spring_record(std::size_t constraint) const {
    const HeldConstraint& c = constraints[constraint];
    SpringRecord record{static_cast<int>(constraint), c.holds};
    for (std::size_t i = 0; i < c.points.size(); ++i) record.impulses[i] = c.points[i].impulse;
    return record;
}

bool World::Implementation::restore_spring(const SpringRecord& record) {
    HeldConstraint& c = constraints.at(static_cast<std::size_t>(record.constraint));
    for (std::size_t i = 0; i < c.points.size(); ++i) c.points[i].impulse = record.impulses[i];
    return std::exchange(c.holds, record.holds) != record.holds;
}

void World::spring_records(std::vector<SpringRecord>& out) const {
    out.clear();
    const Implementation& w = *implementation_;
    for (std::size_t i = 0; i < w.constraints.size(); ++i) {
        const HeldConstraint& c = w.constraints[i];
        if (w.bodies[static_cast<std::size_t>(first_mover(w.bodies, c.definition))].own)
            out.push_back(w.spring_record(i));
    }
}

void World::restore_contacts(const std::vector<ContactRecord>& foreign,
                             const std::vector<SpringRecord>& springs) {
    Implementation& w = *implementation_;
    auto& manifolds = w.contacts.manifolds();
    const std::size_t own = manifolds.size();
    for (const ContactRecord& record : foreign) manifolds.push_back(manifold_of(record));
    auto before = [](const Manifold& a, const Manifold& b) { return a.key() < b.key(); };
    std::inplace_merge(manifolds.begin(), manifolds.begin() + static_cast<std::ptrdiff_t>(own),
                       manifolds.end(), before);
    // Solved here and elsewhere: the same.
    manifolds.erase(std::unique(manifolds.begin(), manifolds.end(),
                                [](const Manifold& a, const Manifold& b) { return a.key() == b.key(); }),
                    manifolds.end());
    bool changed = false;
    for (const SpringRecord& record : springs) {
        changed = w.restore_spring(record) || changed;
    }
    if (changed) w.set_joined();
}

WorldSnapshot World::snapshot() const {
    Implementation& w = *implementation_;
    WorldSnapshot s;
    s.step = w.counts.steps;
    s.bodies.reserve(w.bodies.size());
    for (int i = 0; i < bodies(); ++i) s.bodies.push_back(record(i));
    for (const Manifold& m : w.contacts.manifolds()) s.contacts.push_back(record_of(m));
    for (std::size_t i = 0; i < w.constraints.size(); ++i) s.springs.push_back(w.spring_record(i));
    s.outside = w.outside;
    return s;
}

void World::rewind(const WorldSnapshot& snapshot) {
    Implementation& w = *implementation_;
    w.outside = snapshot.outside;
    set_step(snapshot.step);
    for (const WorldRecord& record : snapshot.bodies) restore(record);
    w.contacts.manifolds().clear();
    restore_contacts(snapshot.contacts, snapshot.springs);
    const auto undone = [&](const auto& told) { return told.step > snapshot.step; };
    std::erase_if(w.quarantined, undone);
    std::erase_if(w.broken, undone);
    for (const FirstStep& first : w.limited)
        if (undone(first)) w.bodies[static_cast<std::size_t>(first.number)].limited_step = 0;
    std::erase_if(w.limited, undone);
}

void World::recall(const WorldPast& past) {
    Implementation& w = *implementation_;
    w.counts = past.counts;
    w.quarantined = past.quarantined, w.limited = past.limited, w.broken = past.broken;
    for (const FirstStep& first : past.limited)
        w.bodies.at(static_cast<std::size_t>(first.number)).limited_step = first.step;
}

void World::set_step(std::uint64_t step) {
    implementation_->counts.steps = step;
    implementation_->end_motions();
}

Eigen::Vector3d World::outside_impulse() const {
    return implementation_->outside;
}

int World::cross_contacts() const noexcept {
    return implementation_->cross_contacts;
}

double World::work(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).work;
}

double World::most_radius(int body) const {
    const BodyKind& kind = *implementation_->bodies.at(static_cast<std::size_t>(body)).kind;
    return kind.surface.bounding_radius() * (kind.modes > 0 ? 1 + kGradientLimit : 1);
}

double World::radius_now(int body) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    return loose_radius(*b.kind, b.state.q);
}

bool World::Implementation::near_own(const Eigen::Vector3d& center, double radius) const {
    return std::any_of(own_balls.begin(), own_balls.end(), [&](const LooseBall& ball) {
        const double reach = ball.radius + radius;
        return (ball.center - center).squaredNorm() <= reach * reach;
    });
}

void World::near_own(const std::vector<ForeignBall>& foreign, std::vector<int>& near) {
    Implementation& w = *implementation_;
    w.own_balls.clear();
    Eigen::AlignedBox3d all;
    for (const int i : w.owned) {
        const MovingBody& body = w.bodies[static_cast<std::size_t>(i)];
        if (!body.moves()) continue;
        const double radius = loose_radius(*body.kind, body.state.q) + contact_reach(body, w.settings);
        w.own_balls.push_back({body.state.position, radius});
        all.extend((body.state.position.array() - radius).matrix());
        all.extend((body.state.position.array() + radius).matrix());
    }
    near.clear();
    for (const ForeignBall& ball : foreign)
        if (all.squaredExteriorDistance(ball.center) <= ball.radius * ball.radius &&
            w.near_own(ball.center, ball.radius))
            near.push_back(ball.body);
}

bool World::is_near_own(int body, const WorldBodyState& state) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    const WorldSettings& settings = implementation_->settings;
    double speed =
        state.velocity.norm() + settings.dt * std::abs(b.gravity_scale) * settings.gravity.norm() +
        state.angular_momentum.norm() / b.kind->mass.inertia.minCoeff() * b.kind->surface.bounding_radius();
    if (b.kind->modes > 0) speed += b.kind->shape_bound.dot(state.q_dot.cwiseAbs());
    return implementation_->near_own(state.position,
                                     loose_radius(*b.kind, state.q) * 1.01 + settings.dt * speed);
}

void World::place_ghost(int body, const WorldBodyState& state, const StepImpulse* held, bool asleep) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    b.state = state;
    b.asleep = asleep;
    b.sleep_group = body;
    b.unposed = true;
    b.pushed = b.watched = b.was_given = false;
    if (held) push(b, implementation_->settings.dt, *held);
    implementation_->placed.push_back(body);
}

void World::kick(int body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    if (!b.moves()) return;
    if (b.asleep) wake(body);
    implementation_->all_whole = false;
    b.state.velocity += linear / b.kind->mass.mass, b.state.angular_momentum += angular;
}

// What would go on into a plane stops there: a guess of what its owner finds.
void World::Implementation::stop_at_planes(MovingBody& body, const Eigen::Vector3d& before) const {
    WorldBodyState& s = body.state;
    for (const WorldPlane& plane : planes) {
        const Eigen::Vector3d own = s.orientation.conjugate() * plane.normal;
        const double reach = own.cwiseProduct(body.kind->half_box).norm();
        const double height = plane.normal.dot(s.position) - plane.offset;
        const double least = std::min(reach, plane.normal.dot(before) - plane.offset);
        if (height >= least) continue;
        s.position += (least - height) * plane.normal;
        s.velocity -= std::min(0.0, s.velocity.dot(plane.normal)) * plane.normal;
    }
}

void World::extrapolate(int body, WorldBodyState& state, const StepImpulse* held) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    std::swap(b.state, state);
    const bool pushed = std::exchange(b.pushed, false);
    if (held) push(b, implementation_->settings.dt, *held);
    const Eigen::Vector3d before = b.state.position;
    move_freely(b, implementation_->settings);
    implementation_->stop_at_planes(b, before);
    const bool limited = b.limited_now;
    (void)limit_deformation(b);
    b.limited_now = limited;  // a guess of what its owner finds
    b.pushed = pushed;
    std::swap(b.state, state);
}

void World::watch(int body, bool watched) {
    implementation_->bodies.at(static_cast<std::size_t>(body)).watched = watched;
}

const std::vector<CrossImpulse>& World::cross_impulses() const noexcept {
    return implementation_->solver().crossed();
}

const StepImpulse* World::impulse(int body) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    return b.was_given ? &b.given : nullptr;
}

}  // namespace sim
