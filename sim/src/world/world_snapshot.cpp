#include "world/world_implementation.h"

// A world's state, taken and taken back to.

namespace sim {
namespace {

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

}  // namespace

void World::Implementation::record(int body, WorldRecord& out) const {
    const MovingBody& b = bodies.at(static_cast<std::size_t>(body));
    out.body = body, out.state = b.state;
    out.asleep = b.asleep, out.quarantined = b.quarantined, out.at_limit = b.at_limit;
    out.still_steps = static_cast<std::uint16_t>(b.still_steps), out.sleep_group = b.sleep_group;
}

void World::Implementation::restore(const WorldRecord& record) {
    MovingBody& b = bodies.at(static_cast<std::size_t>(record.body));
    b.state = record.state;
    all_whole = false;
    b.asleep = record.asleep, b.at_limit = record.at_limit;
    b.still_steps = record.still_steps, b.sleep_group = record.sleep_group;
    b.pushed = b.was_given = false;
    b.unposed = true;
    if (record.quarantined && !b.quarantined) drop_constraints(record.body);
    b.quarantined = record.quarantined;
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

void World::Implementation::restore(const std::vector<SpringRecord>& springs) {
    bool changed = false;
    for (const SpringRecord& record : springs) changed = restore_spring(record) || changed;
    if (changed) set_joined();
}

void World::Implementation::set_step(std::uint64_t step) {
    counts.steps = step;
    end_motions();
}

WorldSnapshot World::snapshot() const {
    Implementation& w = *implementation_;
    WorldSnapshot s;
    s.step = w.counts.steps;
    s.bodies.reserve(w.bodies.size());
    for (int i = 0; i < bodies(); ++i) w.record(i, s.bodies.emplace_back());
    for (const Manifold& m : w.contacts.manifolds()) s.contacts.push_back(record_of(m));
    for (std::size_t i = 0; i < w.constraints.size(); ++i) s.springs.push_back(w.spring_record(i));
    s.outside = w.outside;
    return s;
}

void World::rewind(const WorldSnapshot& snapshot) {
    Implementation& w = *implementation_;
    w.outside = snapshot.outside;
    w.set_step(snapshot.step);
    for (const WorldRecord& record : snapshot.bodies) w.restore(record);
    w.contacts.manifolds().clear();
    for (const ContactRecord& record : snapshot.contacts)
        w.contacts.manifolds().push_back(manifold_of(record));
    w.restore(snapshot.springs);
    const auto undone = [&](const auto& event) { return event.step > snapshot.step; };
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

}  // namespace sim
