#include <algorithm>
#include <atomic>
#include <string>

#include "world/world_check.h"
#include "world/world_implementation.h"

// One step of a world, and what becomes of bodies whose state is not finite.

namespace sim {
namespace {

// Work of a pair of bodies in contact, and of each of its points, in units of a body that touches nothing; measured on heaps of
// balls with 12 modes. Only shares matter: workers trade bodies by them.
constexpr double kWorkOfPair = 0.5, kWorkOfPoint = 0.75;

}  // namespace

// A step. docs/design.md, "A step", says it in the same order.
void World::Implementation::step() {
    const FlushDenormals flush;
    begin_step();
    if (!any_awake()) return end_step();
    pose_bodies();
    contacts.find(contact_scene(*crew));
    find_islands();
    solve_islands();
    list_broken();
    list_limited();
    put_to_sleep();
    count_work();
    quarantine_results();
    end_step();
}

// Motions and forces of the schedule, and who takes part.
void World::Implementation::begin_step() {
    solving = false;
    solver().cross().begin_step(shared);
    outside_before = outside;
    ++counts.steps;
    counts.contacts = counts.pairs = counts.islands = 0;
    begin_motions();
    find_forces();
    gather();
    quarantine_broken();
    for (const int i : participants)
        if (bodies[static_cast<std::size_t>(i)].pushed && bodies[static_cast<std::size_t>(i)].asleep)
            wake_group(bodies, i);
}

void World::Implementation::end_step() {
    end_motions();
    dismiss_ghosts();
}

// For contact tests.
void World::Implementation::pose_bodies() {
    crew->each(participants.size(), 16, [this](int, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            MovingBody& body = bodies[static_cast<std::size_t>(participants[i])];
            body.was_given = false;
            if (body.moves() && (!body.asleep || body.unposed)) pose(body);
        }
    });
}

void World::Implementation::gather() {
    if (shared) return gather_shared();
    participants.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i)
        if (!bodies[i].quarantined) participants.push_back(static_cast<int>(i));
}

// Whether anything happens in this step.
bool World::Implementation::any_awake() const {
    return std::any_of(participants.begin(), participants.end(), [this](int i) {
        const MovingBody& body = bodies[static_cast<std::size_t>(i)];
        return body.driven || (body.moves() && !body.asleep);
    });
}

// Bodies whose state or forces are not finite, or absurd, take no further part. Before anything else in a
// step, before they can touch another body.
void World::Implementation::quarantine_broken() {
    if (std::exchange(all_whole, true)) return;
    if (!any_broken([](const MovingBody& body) { return body.moves() && body.own; })) return;
    for (const int i : participants) {
        const MovingBody& body = bodies[static_cast<std::size_t>(i)];
        if (!body.moves() || !body.own) continue;
        const std::string what = what_is_broken(body);
        if (!what.empty()) quarantine(i, what);
    }
    std::erase_if(participants, [this](int i) { return bodies[static_cast<std::size_t>(i)].quarantined; });
}

template <typename Concerned>
bool World::Implementation::any_broken(Concerned concerned) {
    std::atomic<bool> any = false;
    crew->each(participants.size(), kBodiesAPiece, [&](int, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            if (const MovingBody& body = bodies[static_cast<std::size_t>(participants[i])];
                concerned(body) && !what_is_broken(body).empty())
                any.store(true, std::memory_order_relaxed);
    });
    return any;
}

// After a step: bodies that it broke, before any reader sees them.
void World::Implementation::quarantine_results() {
    // Islands that were solved, so of awake bodies.
    const bool any = any_broken([](const MovingBody& body) { return body.moves(); });
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_own(islands[i])) continue;
        for (const int id : islands[i].bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            body.pushed = false;
            if (!any || (shared && !body.own)) continue;  // its owner's affair
            const std::string what = what_is_broken(body);
            if (!what.empty()) quarantine(id, what);
        }
    }
}

void World::Implementation::quarantine(int id, const std::string& what) {
    MovingBody& body = bodies[static_cast<std::size_t>(id)];
    body.quarantined = true;
    body.asleep = body.pushed = false;
    body.stop();  // where it was last seen whole
    body.state.position = body.posed.position;
    body.state.orientation = Eigen::Quaterniond(body.posed.rotation);
    body.state.q.setZero();
    if (body.own || !shared) quarantined.push_back({id, counts.steps, what});
    // What it did to others may be as broken as it is.
    std::erase_if(contacts.manifolds(), [id](const Manifold& m) { return m.a == id || m.b == id; });
    drop_constraints(id);
}

void World::Implementation::drop_constraints(int body) {
    for (HeldConstraint& c : constraints)
        if (c.definition.body_a == body || c.definition.body_b == body) {
            c.holds = false;
            for (HeldPoint& point : c.points) point.impulse.setZero();
        }
    set_joined();
}

void World::Implementation::list_broken() {
    for (std::size_t c = 0; c < constraints.size(); ++c)
        if (springs_before[c].holds && !constraints[c].holds)
            broken.push_back({static_cast<int>(c), counts.steps});
}

void World::Implementation::list_limited() {
    for (const int i : participants) {
        MovingBody& body = bodies[static_cast<std::size_t>(i)];
        const bool now = std::exchange(body.limited_now, false);
        if (!now || !body.own || body.limited_step != 0) continue;
        body.limited_step = counts.steps;
        limited.push_back({i, counts.steps});
    }
}

void World::Implementation::count_work() {
    for (const int i : participants) {
        MovingBody& body = bodies[static_cast<std::size_t>(i)];
        body.work = body.moves() && !body.asleep ? 1 : 0;
    }
    cross_contacts = counts.contacts = 0;
    auto own = [this](int id) { return id < kFirstPlane && bodies[static_cast<std::size_t>(id)].own; };
    for (const Manifold& m : contacts.manifolds()) {
        if (!own(m.a) && !own(m.b)) continue;
        counts.contacts += m.count;
        const bool both = m.b < kFirstPlane && bodies[static_cast<std::size_t>(m.b)].moves() &&
                          bodies[static_cast<std::size_t>(m.a)].moves();
        if (both && own(m.a) != own(m.b)) cross_contacts += m.count;
        const double work = kWorkOfPair + kWorkOfPoint * m.count;
        const bool halved = own(m.a) && own(m.b) && both;
        if (own(m.a)) bodies[static_cast<std::size_t>(m.a)].work += halved ? work / 2 : work;
        if (own(m.b)) bodies[static_cast<std::size_t>(m.b)].work += halved ? work / 2 : work;
    }
    counts.pairs = contacts.pairs();
    counts.inverse_fallbacks += contacts.fallbacks();
    counts.impacts += contacts.impacts();
    counts.asleep = static_cast<int>(
        std::count_if(bodies.begin(), bodies.end(), [](const MovingBody& b) { return b.asleep; }));
}

}  // namespace sim
