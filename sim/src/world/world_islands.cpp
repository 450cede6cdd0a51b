#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

// Islands: bodies that contacts and constraints join, and when they fall asleep.

namespace sim {
namespace {

constexpr double kStillTime = 0.5;  // below the sleep speed, after which a body may fall asleep [s]

}  // namespace

void World::Implementation::find_islands() {
    sets.reset(bodies.size());
    auto moves = [this](int id) {
        return id >= 0 && id < kFirstPlane && bodies[static_cast<std::size_t>(id)].moves();
    };
    // What broke since the step began joins until it ends: an island that is solved again begins as it was.
    auto held_here = [&](std::size_t constraint) {
        const HeldConstraint& c = constraints[constraint];
        const int a = c.definition.body_a, b = c.definition.body_b;
        const bool away = shared && !bodies[static_cast<std::size_t>(moves(a) ? a : std::max(b, 0))].own;
        return (solving ? springs_before[constraint].holds : c.holds) && !away;
    };
    auto is_here = [this](int id) {
        return !shared || std::binary_search(participants.begin(), participants.end(), id);
    };
    const auto& manifolds = contacts.manifolds();
    touching.resize(manifolds.size());
    crew->each(touching.size(), 4 * kBodiesAPiece, [&](int, std::size_t first, std::size_t end) {
        for (std::size_t m = first; m < end; ++m)
            touching[m] = {moves(manifolds[m].a) ? manifolds[m].a : -1,
                           moves(manifolds[m].b) ? manifolds[m].b : -1};
    });
    for (const auto& [a, b] : touching)
        if (a >= 0 && b >= 0) sets.join(a, b);
    for (std::size_t c = 0; c < constraints.size(); ++c)
        if (const PointConstraint& held = constraints[c].definition;
            held_here(c) && moves(held.body_a) && moves(held.body_b))
            sets.join(held.body_a, held.body_b);
    // An island's place is that of its first body.
    place.assign(bodies.size(), -1);
    islands_used = 0;
    auto island_of = [&](int id) -> Island& {
        int& at = place[static_cast<std::size_t>(sets.first(id))];
        if (at < 0) {
            at = static_cast<int>(islands_used++);
            if (islands.size() < islands_used) islands.emplace_back();
            Island& fresh = islands[static_cast<std::size_t>(at)];
            fresh.bodies.clear(), fresh.manifolds.clear(), fresh.constraints.clear();
        }
        return islands[static_cast<std::size_t>(at)];
    };
    for (const int i : participants)
        if (const MovingBody& body = bodies[static_cast<std::size_t>(i)]; body.moves() && !body.asleep)
            island_of(i).bodies.push_back(i);
    for (std::size_t m = 0; m < touching.size(); ++m)
        island_of(touching[m].first >= 0 ? touching[m].first : touching[m].second)
            .manifolds.push_back(static_cast<int>(m));
    for (std::size_t c = 0; c < constraints.size(); ++c) {
        const PointConstraint& held = constraints[c].definition;
        const int id = moves(held.body_a) ? held.body_a : moves(held.body_b) ? held.body_b : -1;
        if (!held_here(c) || id < 0) continue;
        const MovingBody& first = bodies[static_cast<std::size_t>(id)];
        if (is_here(id) && !first.asleep) island_of(id).constraints.push_back(static_cast<int>(c));
    }
}

bool World::Implementation::is_own(const Island& island) const {
    if (!shared) return !island.bodies.empty();
    return std::any_of(island.bodies.begin(), island.bodies.end(),
                       [this](int id) { return bodies[static_cast<std::size_t>(id)].own; });
}

int World::Implementation::still_steps_to_sleep() const {
    return static_cast<int>(std::ceil(kStillTime / settings.dt - 1e-9));
}

// Whether something that does not move holds an island up.
bool World::Implementation::is_held(const Island& island) const {
    const auto holds = [this](int id) {
        return id < 0 || !bodies[static_cast<std::size_t>(id)].moves() ||
               bodies[static_cast<std::size_t>(id)].asleep;
    };
    return std::ranges::any_of(island.manifolds,
                               [&](int m) {
                                   const auto& [a, b] = touching[static_cast<std::size_t>(m)];
                                   return holds(a) || holds(b);
                               }) ||
           std::ranges::any_of(island.constraints, [&](int c) {
               const PointConstraint& held = constraints[static_cast<std::size_t>(c)].definition;
               return holds(held.body_a) || holds(held.body_b);
           });
}

// Whether an island that nothing holds goes on, or would fall.
bool World::Implementation::drifts(const Island& island) const {
    constexpr double kAtRest = 1e-3;  // of the sleep speed
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
    double mass = 0;
    for (const int id : island.bodies) {
        const MovingBody& body = bodies[static_cast<std::size_t>(id)];
        momentum += body.kind->mass.mass * body.state.velocity, mass += body.kind->mass.mass;
        if (body.gravity_scale * settings.gravity.norm() != 0) return true;
    }
    return momentum.norm() > kAtRest * settings.sleep_speed * mass;
}

void World::Implementation::put_to_sleep() {
    const int wanted = std::min(still_steps_to_sleep(), kMostStillSteps);
    for (std::size_t i = 0; i < islands_used; ++i) {
        const Island& island = islands[i];
        if (!is_own(island)) continue;
        bool still = settings.sleeping && !outcomes[static_cast<std::size_t>(island.bodies.front())].carried;
        const bool flies = island.manifolds.empty() && island.constraints.empty();
        for (const int id : island.bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            // What flies has not begun to come to rest.
            const double speed = flies ? 1e-9 : settings.sleep_speed;
            const bool slow = body.state.velocity.norm() < speed && point_speed(body) < speed;
            body.still_steps = slow ? std::min(body.still_steps + 1, kMostStillSteps) : 0;
            still = still && body.still_steps >= wanted;
            // What bodies of another world touch can rest only with them.
            if (shared) still = still && body.own && !body.pushed;
        }
        if (!still || (!is_held(island) && drifts(island))) continue;
        for (const int id : island.bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            if (body.own) outside -= body.kind->mass.mass * body.state.velocity;
            body.asleep = true;
            body.sleep_group = island.bodies.front();
            body.stop();
            pose(body);
        }
    }
}

}  // namespace sim
