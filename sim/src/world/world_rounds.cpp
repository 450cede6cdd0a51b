#include <algorithm>

#include "world/world_implementation.h"

// Solves a step's islands, and those again in which bodies meet what nobody foresaw.

namespace sim {
namespace {

constexpr int kRounds = 24;  // then what still meets is held apart

// The impulse on a, and the opposite on b, half-way between the places that their arms reach, after which they
// do not approach each other at the point. Applied, and returned.
Eigen::Vector3d stop_approach(MovingBody& a, MovingBody& b, const ManifoldPoint& point) {
    const Eigen::Vector3d n = point.normal.cast<double>();
    const bool both = a.moves() && b.moves();
    const Eigen::Vector3d on_a = a.state.position + point.arm_a.cast<double>(),
                          on_b = b.state.position + point.arm_b.cast<double>(),
                          place = both        ? Eigen::Vector3d((on_a + on_b) / 2)
                                  : a.moves() ? on_a
                                              : on_b;
    double speed = 0, mobility = 0;
    for (const MovingBody* body : {&a, &b}) {
        const Eigen::Vector3d arm = place - body->state.position, lever = arm.cross(n);
        const Eigen::Vector3d spin = spin_of(*body, body->state.orientation, body->state.angular_momentum);
        speed += (body == &a ? 1 : -1) * n.dot(body->state.velocity + spin.cross(arm));
        if (body->moves())
            mobility += 1 / body->kind->mass.mass + lever.dot(spin_of(*body, body->state.orientation, lever));
    }
    const Eigen::Vector3d impulse = std::max(0.0, -speed) / mobility * n;
    for (MovingBody* body : {&a, &b}) {
        if (!body->moves()) continue;
        const Eigen::Vector3d p = body == &a ? impulse : Eigen::Vector3d(-impulse);
        body->state.velocity += p / body->kind->mass.mass;
        body->state.angular_momentum += (place - body->state.position).cross(p);
    }
    return impulse;
}

}  // namespace

ContactScene World::Implementation::contact_scene() {
    return {settings, planes, joined, bodies, here, sharing == Sharing::pairs};
}

// islands: others' bodies, too, as own ones may meet them unforeseen.
bool World::Implementation::is_solved(const Island& island) const {
    return is_own(island) || sharing == Sharing::islands;
}

void World::Implementation::start_solving() {
    started.resize(bodies.size());
    at_limit_before.resize(bodies.size());
    outcomes.resize(bodies.size());
    solved.assign(bodies.size(), false);
    again.assign(bodies.size(), false);
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_solved(islands[i])) continue;
        for (const int id : islands[i].bodies) {
            const auto at = static_cast<std::size_t>(id);
            started[at] = bodies[at].state;
            at_limit_before[at] = bodies[at].at_limit;
        }
    }
    springs_before.clear();
    for (std::size_t c = 0; c < constraints.size(); ++c) springs_before.push_back(spring_record(c));
}

void World::Implementation::move_alone(int id) {
    MovingBody& body = bodies[static_cast<std::size_t>(id)];
    Outcome& outcome = outcomes[static_cast<std::size_t>(id)];
    const Eigen::Vector3d before = body.state.velocity;
    move_freely(body, settings);
    if (limit_deformation(body)) ++outcome.limited;
    if (body.own) outcome.outside += body.kind->mass.mass * (body.state.velocity - before);
    if (body.pushed && sharing == Sharing::pairs) outcome.outside -= settings.dt * body.force;
}

void World::Implementation::solve_island(const Island& island, bool follow) {
    Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    outcome.outside.setZero(), outcome.limited = outcome.broken = 0, outcome.found = false;
    outcome.carried = solver->is_carried(island);
    if (island.manifolds.empty() && island.constraints.empty() && !is_forced(island.bodies.front()))
        return move_alone(island.bodies.front());
    const std::uint64_t limits = solver->deformations_limited(), breaks = solver->constraints_broken();
    solver->solve(island, contact_scene(), follow && solver->may_follow(island));
    if (const std::vector<Manifold>* found = solver->found()) {
        outcome.found = true, outcome.manifolds = *found;
        for (const Manifold& m : *found) contacts.note_known(m.key());
    }
    outcome.limited = solver->deformations_limited() - limits;
    outcome.broken = solver->constraints_broken() - breaks;
    outcome.outside = solver->take_outside_impulse();
    for (const int id : island.bodies) {
        const MovingBody& body = bodies[static_cast<std::size_t>(id)];
        solved[static_cast<std::size_t>(id)] = true;
        if (sharing != Sharing::pairs && body.pushed && body.own) outcome.outside += settings.dt * body.force;
    }
}

void World::Implementation::solve_again() {
    find_islands();
    for (std::size_t i = 0; i < islands_used; ++i) {
        const Island& island = islands[i];
        const bool any = std::any_of(island.bodies.begin(), island.bodies.end(),
                                     [this](int id) { return again[static_cast<std::size_t>(id)]; });
        if (!any || !is_solved(island)) continue;
        for (const int id : island.bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            body.state = started[static_cast<std::size_t>(id)];
            body.at_limit = at_limit_before[static_cast<std::size_t>(id)], body.limited_now = false;
            body.was_given = false;
            solver->forget_crossed(id);
        }
        for (const int m : island.manifolds)
            contacts.rewarm(contacts.manifolds()[static_cast<std::size_t>(m)]);
        for (const int c : island.constraints)
            (void)restore_spring(springs_before[static_cast<std::size_t>(c)]);
        solve_island(island, true);
    }
    ++counts.solved_again;
}

// The last resort: the island stops where the bodies meet, as it moves then, and these stop approaching each
// other.
void World::Implementation::hold_apart(const WorldContacts::Meeting& meeting) {
    auto at = [this](int id) -> MovingBody& { return bodies[static_cast<std::size_t>(id)]; };
    // Joined bodies would be torn apart: what they meet, they meet in the next step.
    for (const int id : {meeting.a, meeting.b})
        if (at(id).moves() &&
            !islands[static_cast<std::size_t>(place[static_cast<std::size_t>(root(id))])].constraints.empty())
            return;
    auto island_of = [this](int id) -> const Island& {
        return islands[static_cast<std::size_t>(place[static_cast<std::size_t>(root(id))])];
    };
    for (const int id : {meeting.a, meeting.b}) {
        if (!at(id).moves()) continue;
        for (const int other : island_of(id).bodies) {
            MovingBody& body = at(other);
            const BodyPath& path = contacts.paths()[static_cast<std::size_t>(other)];
            const BodyPath::Pose pose = path.at(meeting.time);
            const BodyPath::Leg& leg = path.leg_at(meeting.time);
            if (body.own)
                outcomes[static_cast<std::size_t>(island_of(id).bodies.front())].outside +=
                    body.kind->mass.mass * (leg.velocity - body.state.velocity);
            body.state.position = pose.position, body.state.orientation = pose.orientation;
            body.state.velocity = leg.velocity, body.state.angular_momentum = leg.momentum;
        }
    }
    const Manifold* manifold = contacts.find_now(meeting.a, meeting.b);
    if (manifold) {
        const Eigen::Vector3d kick = stop_approach(at(meeting.a), at(meeting.b), manifold->points[0]);
        for (const int id : {meeting.a, meeting.b}) {
            const int other = id == meeting.a ? meeting.b : meeting.a;
            if (at(id).moves() && at(id).own && !at(other).moves())
                outcomes[static_cast<std::size_t>(island_of(id).bodies.front())].outside +=
                    id == meeting.a ? kick : Eigen::Vector3d(-kick);
        }
    }
    ++counts.held_apart;
}

void World::Implementation::sum_outcomes() {
    bool breaks = false;
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_solved(islands[i])) continue;
        const Outcome& outcome = outcomes[static_cast<std::size_t>(islands[i].bodies.front())];
        breaks = breaks || outcome.broken > 0;
        if (!is_own(islands[i])) continue;
        outside += outcome.outside;
        counts.deformations_limited += outcome.limited;
        counts.constraints_broken += outcome.broken;
    }
    if (breaks) set_joined();
    if (!outside.allFinite()) outside = outside_before;  // of a body that is breaks
}

void World::Implementation::solve_islands() {
    start_solving();
    int awake = 0;
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_solved(islands[i])) continue;
        awake += is_own(islands[i]);
        solve_island(islands[i], false);
    }
    for (int round = 0; round <= kRounds; ++round) {
        const auto& meetings = contacts.unforeseen(contact_scene(), solved);
        if (meetings.empty()) break;
        if (round == kRounds) {
            last = meetings;
            // The first last: an island stops where it meets first.
            std::sort(last.begin(), last.end(), [](const auto& a, const auto& b) { return a.time > b.time; });
            for (const WorldContacts::Meeting& meeting : last) hold_apart(meeting);
            break;
        }
        again.assign(bodies.size(), false);
        for (const WorldContacts::Meeting& meeting : meetings)
            again[static_cast<std::size_t>(meeting.a)] = again[static_cast<std::size_t>(meeting.b)] = true;
        solve_again();
    }
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_solved(islands[i])) continue;
        const Outcome& outcome = outcomes[static_cast<std::size_t>(islands[i].bodies.front())];
        if (outcome.found) contacts.replace(islands[i].bodies, outcome.manifolds);
    }
    contacts.keep_last();
    counts.islands = awake;
    sum_outcomes();
}

}  // namespace sim
