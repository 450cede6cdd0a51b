#include <algorithm>

#include "world/world_implementation.h"

// Solves a step's islands, and those again in which bodies meet what nobody foresaw.

namespace sim {
namespace {

constexpr int kRounds = 24;  // then what still meets is held apart

struct Kick {
    Eigen::Vector3d impulse, place;
};

// The impulse on a, and the opposite on b, half-way between the places that their arms reach, after which they
// do not approach each other at the point. Applied, and returned.
Kick stop_approach(MovingBody& a, MovingBody& b, const ManifoldPoint& point) {
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
    return {impulse, place};
}

}  // namespace

ContactScene World::Implementation::contact_scene(Crew& by) {
    return {settings, planes, joined, bodies, participants, shared, by};
}

void World::Implementation::start_solving() {
    solving = true;
    started.resize(bodies.size());
    at_limit_before.resize(bodies.size());
    outcomes.resize(bodies.size());
    solved.assign(bodies.size(), 0);
    again.assign(bodies.size(), 0);
    // Also of islands of ghosts alone: own bodies may meet these unforeseen.
    for (std::size_t i = 0; i < islands_used; ++i) {
        const std::vector<int>& of_island = islands[i].bodies;
        crew->each(of_island.size(), kBodiesAPiece, [&](int, std::size_t first, std::size_t end) {
            for (std::size_t k = first; k < end; ++k) {
                const auto at = static_cast<std::size_t>(of_island[k]);
                started[at] = bodies[at].state;
                at_limit_before[at] = bodies[at].at_limit;
            }
        });
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
}

void World::Implementation::solve_island(const Island& island, bool follow, IslandSolver& by,
                                         const ContactScene& scene) {
    Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    outcome.outside.setZero(), outcome.limited = outcome.broken = 0, outcome.found = false;
    outcome.carried = by.is_carried(island);
    if (island.manifolds.empty() && island.constraints.empty() && !is_forced(island.bodies.front()))
        return move_alone(island.bodies.front());
    const std::uint64_t limits = by.deformations_limited(), breaks = by.constraints_broken();
    by.solve(island, scene, follow);
    if (const std::vector<Manifold>* found = by.found()) outcome.found = true, outcome.manifolds = *found;
    outcome.limited = by.deformations_limited() - limits;
    outcome.broken = by.constraints_broken() - breaks;
    outcome.outside = by.take_outside_impulse();
    for (const int id : island.bodies) {
        const MovingBody& body = bodies[static_cast<std::size_t>(id)];
        solved[static_cast<std::size_t>(id)] = 1;
        if (body.pushed && body.own) outcome.outside += settings.dt * body.force;
    }
}

bool World::Implementation::is_by_one(const Island& island) const {
    return island.bodies.size() < kLeastDivided;
}

// Large islands are shared out, one after the other; of small ones every thread solves its own.
void World::Implementation::share_islands(const Solve& solve) {
    Crew& by = *crew;
    const ContactScene by_all = contact_scene(by), by_one = contact_scene(alone);
    // A shared world has one solver for all islands: it records what ghosts are given in the order of islands.
    if (by.size() == 1 || shared) {
        for (const Island* island : to_solve) solve(*island, solver(), is_by_one(*island) ? by_one : by_all);
        return;
    }
    for (const Island* island : to_solve)
        if (!is_by_one(*island)) solve(*island, solver(), by_all);
    small.clear();
    std::ranges::copy_if(to_solve, std::back_inserter(small),
                         [this](const Island* island) { return is_by_one(*island); });
    // The longest first, so that none is left to one thread at the end: those with constraints are solved directly.
    const auto size = [](const Island* island) {
        return (island->constraints.empty() ? 1 : 100) * island->bodies.size() + island->manifolds.size();
    };
    std::ranges::sort(small, [&](const Island* a, const Island* b) {
        return std::pair(size(a), a->bodies.front()) > std::pair(size(b), b->bodies.front());
    });
    by.each(small.size(), 1, [&](int thread, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            solve(*small[i], *solvers[static_cast<std::size_t>(thread)], by_one);
    });
}

void World::Implementation::note_found() {
    for (const Island* island : to_solve) {
        const Outcome& outcome = outcomes[static_cast<std::size_t>(island->bodies.front())];
        if (!outcome.found) continue;
        for (const Manifold& m : outcome.manifolds) contacts.note_known(m.key());
    }
}

// Takes an island back to the step's start.
void World::Implementation::begin_again(const Island& island) {
    for (const int id : island.bodies) {
        MovingBody& body = bodies[static_cast<std::size_t>(id)];
        body.state = started[static_cast<std::size_t>(id)];
        body.at_limit = at_limit_before[static_cast<std::size_t>(id)] != 0, body.limited_now = false;
        body.was_given = false;
    }
    for (const int m : island.manifolds) contacts.rewarm(contacts.manifolds()[static_cast<std::size_t>(m)]);
    for (const int c : island.constraints) (void)restore_spring(springs_before[static_cast<std::size_t>(c)]);
}

void World::Implementation::solve_again() {
    find_islands();
    to_solve.clear();
    for (std::size_t i = 0; i < islands_used; ++i) {
        const bool any = std::any_of(islands[i].bodies.begin(), islands[i].bodies.end(),
                                     [this](int id) { return again[static_cast<std::size_t>(id)] != 0; });
        if (!any || !is_own(islands[i])) continue;
        to_solve.push_back(&islands[i]);
        for (const int id : islands[i].bodies) solver().cross().forget(id);
    }
    share_islands([this](const Island& island, IslandSolver& by, const ContactScene& scene) {
        begin_again(island);
        solve_island(island, true, by, scene);
    });
    note_found();
    ++counts.solved_again;
}

// The last resort: the island stops where the bodies meet, as it moves then, and these stop approaching each
// other.
void World::Implementation::hold_apart(const StepContacts::Meeting& meeting) {
    auto at = [this](int id) -> MovingBody& { return bodies[static_cast<std::size_t>(id)]; };
    // Joined bodies would be torn apart: what they meet, they meet in the next step.
    for (const int id : {meeting.a, meeting.b})
        if (at(id).moves() &&
            !islands[static_cast<std::size_t>(place[static_cast<std::size_t>(sets.first(id))])]
                 .constraints.empty())
            return;
    auto island_of = [this](int id) -> const Island& {
        return islands[static_cast<std::size_t>(place[static_cast<std::size_t>(sets.first(id))])];
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
    if (Manifold* manifold = contacts.find_now(meeting.a, meeting.b)) {
        const Kick kick = stop_approach(at(meeting.a), at(meeting.b), manifold->points[0]);
        for (const int id : {meeting.a, meeting.b}) {
            const int other = id == meeting.a ? meeting.b : meeting.a;
            if (!at(id).moves() || !at(id).own) continue;
            const Eigen::Vector3d on_it = id == meeting.a ? kick.impulse : Eigen::Vector3d(-kick.impulse);
            if (!at(other).moves())
                outcomes[static_cast<std::size_t>(island_of(id).bodies.front())].outside += on_it;
            else if (!at(other).own)
                solver().cross().add({id, other, true, on_it,
                                      (kick.place - at(id).state.position).cross(on_it),
                                      (kick.place - at(other).state.position).cross(-on_it)});
        }
    }
    ++counts.held_apart;
}

void World::Implementation::sum_outcomes() {
    bool breaks = false;
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_own(islands[i])) continue;
        const Outcome& outcome = outcomes[static_cast<std::size_t>(islands[i].bodies.front())];
        breaks = breaks || outcome.broken > 0;
        outside += outcome.outside;
        counts.deformations_limited += outcome.limited;
        counts.constraints_broken += outcome.broken;
    }
    if (breaks) set_joined();
    if (!outside.allFinite()) outside = outside_before;  // of a body that is not finite any more
}

void World::Implementation::solve_islands() {
    start_solving();
    int awake = 0;
    to_solve.clear();
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_own(islands[i])) continue;
        ++awake;
        to_solve.push_back(&islands[i]);
    }
    share_islands([this](const Island& island, IslandSolver& by, const ContactScene& scene) {
        solve_island(island, false, by, scene);
    });
    note_found();
    for (int round = 0; round <= kRounds; ++round) {
        const auto& meetings = contacts.unforeseen(contact_scene(*crew), solved, started);
        if (meetings.empty()) break;
        if (round == kRounds) {
            last = meetings;
            // The first last: an island stops where it meets first.
            std::sort(last.begin(), last.end(), [](const auto& a, const auto& b) { return a.time > b.time; });
            for (const StepContacts::Meeting& meeting : last) hold_apart(meeting);
            break;
        }
        again.assign(bodies.size(), 0);
        for (const StepContacts::Meeting& meeting : meetings)
            again[static_cast<std::size_t>(meeting.a)] = again[static_cast<std::size_t>(meeting.b)] = 1;
        solve_again();
    }
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_own(islands[i])) continue;
        const Outcome& outcome = outcomes[static_cast<std::size_t>(islands[i].bodies.front())];
        if (outcome.found) contacts.replace(islands[i].bodies, outcome.manifolds);
    }
    contacts.keep_last();
    counts.islands = awake;
    sum_outcomes();
}

}  // namespace sim
