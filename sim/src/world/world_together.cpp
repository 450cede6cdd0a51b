#include "world/step_records.h"
#include "world/world_implementation.h"

// A step by several partners (partners.h): each finds the contacts of its bodies and solves the islands whose first body is
// its own, and all sweep a part of a large one (island_partners.cpp). Everything else each does for itself, as if alone. What is
// found and solved they tell each other, so that the worlds are the same again.

namespace sim {

bool World::Implementation::is_by_one(const Island& island) const {
    return island.bodies.size() < kLeastDivided;
}

void World::Implementation::step_together(Partners& partners) {
    own_alone.resize(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) own_alone[i] = std::exchange(bodies[i].own, true);
    const Sharing before = std::exchange(sharing, Sharing::alone);
    const std::size_t known = quarantined.size();
    with = &partners, divided = nullptr;
    try {
        step();
    } catch (...) {
        for (const auto& solver : solvers) solver->give_up();
        if (with) end_together();
        sharing = before;
        throw;
    }
    if (with) end_together();
    sharing = before;
    // Each tells of its own.
    for (std::size_t q = quarantined.size(); q > known; --q)
        if (!bodies[static_cast<std::size_t>(quarantined[q - 1].body)].own)
            quarantined.erase(quarantined.begin() + static_cast<std::ptrdiff_t>(q - 1));
}

// From here on each does alone what is left of the step, for all bodies, and tells of its own.
void World::Implementation::end_together() noexcept {
    with = nullptr;
    for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].own = own_alone[i] != 0;
}

void World::Implementation::solve_together(const Solve& solve, bool first) {
    while (solvers.size() < 2) {
        solvers.push_back(
            std::make_unique<IslandSolver>(settings, bodies, contacts.manifolds(), constraints));
        solvers.back()->record(&contacts.paths());
    }
    IslandSolver &one = *solvers[0], &part = *solvers[1];
    part.begin_step(counts.steps - 1, active);
    const ContactScene scene = contact_scene(alone);
    auto is_own_island = [this](const Island& island) {
        return with->of(island.bodies.front()) == with->self();
    };
    ByteWriter out;
    for (const Island* island : to_solve)
        if (is_by_one(*island) && is_own_island(*island)) {
            solve(*island, one, scene);
            write_result(out, *island);
        }
    divided = nullptr;
    for (const Island* island : to_solve) {
        if (is_by_one(*island)) continue;
        if (first && !divided && part.begin_together(*island, scene, *with)) {
            divided = island;
            part.write_part(out);
        } else {
            solve(*island, one, scene);
        }
    }
    with->tell_all(std::move(out.bytes()));
    for (int p = 0; p < with->count(); ++p) {
        if (p == with->self()) continue;
        const Partners::Bytes heard = with->hear(p);
        ByteReader in(heard);
        for (const Island* island : to_solve)
            if (is_by_one(*island) && with->of(island->bodies.front()) == p) read_result(in, *island);
        if (divided) part.read_part(in, p);
        in.expect_end();
    }
    if (!divided) return;
    Outcome& outcome = outcomes[static_cast<std::size_t>(divided->bodies.front())];
    const std::uint64_t limits = part.deformations_limited();
    if (!part.end_together()) {  // it has to be solved directly: by each, from its start
        const Island& whole = *std::exchange(divided, nullptr);
        begin_again(whole);
        return solve(whole, one, scene);
    }
    outcome = {};
    outcome.limited = limits - part.limited_before();
    outcome.outside = part.take_outside_impulse();
    for (const int id : divided->bodies) solved[static_cast<std::size_t>(id)] = 1;
}

void World::Implementation::write_result(ByteWriter& out, const Island& island) const {
    for (const int id : island.bodies) write(out, bodies[static_cast<std::size_t>(id)]);
    const Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    out.number(outcome.limited), out.number(outcome.broken);
    out.number<std::uint8_t>(solved[static_cast<std::size_t>(island.bodies.front())]);
    out.number<std::uint8_t>(outcome.found);
    if (outcome.found) {
        out.count(outcome.manifolds.size());
        for (const Manifold& m : outcome.manifolds) write(out, m);
    }
    for (const int m : island.manifolds)
        write_impulses(out, contacts.manifolds()[static_cast<std::size_t>(m)]);
    for (const int c : island.constraints) {
        const HeldConstraint& held = constraints[static_cast<std::size_t>(c)];
        out.number<std::uint8_t>(held.holds);
        for (const HeldPoint& point : held.points) write_floats(out, {point.impulse.data(), 3});
    }
}

void World::Implementation::read_result(ByteReader& in, const Island& island) {
    for (const int id : island.bodies) read(in, bodies[static_cast<std::size_t>(id)]);
    Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    outcome.outside.setZero(), outcome.counts = false;
    outcome.carried = solver().is_carried(island);
    outcome.limited = in.number<std::uint64_t>(), outcome.broken = in.number<std::uint64_t>();
    const bool by_solver = in.flag();
    if (by_solver)
        for (const int id : island.bodies) solved[static_cast<std::size_t>(id)] = 1;
    outcome.found = in.flag();
    if (outcome.found) {
        outcome.manifolds.resize(in.count(22));
        for (Manifold& m : outcome.manifolds) read(in, m, bodies, planes.size());
    }
    for (const int m : island.manifolds) read_impulses(in, contacts.manifolds()[static_cast<std::size_t>(m)]);
    for (const int c : island.constraints) {
        HeldConstraint& held = constraints[static_cast<std::size_t>(c)];
        held.holds = in.flag();
        for (HeldPoint& point : held.points) read_floats(in, {point.impulse.data(), 3});
    }
}

// Of all bodies that were solved: some left theirs, and may meet any.
void World::Implementation::share_paths() {
    auto by_one = [&](int partner, const auto& visit) {
        for (std::size_t i = 0; i < islands_used; ++i) {
            const Island& island = islands[i];
            if (!is_by_one(island) || with->of(island.bodies.front()) != partner ||
                solved[static_cast<std::size_t>(island.bodies.front())] == 0)
                continue;
            for (const int id : island.bodies) visit(contacts.paths()[static_cast<std::size_t>(id)]);
        }
    };
    IslandSolver& part = *solvers[1];
    ByteWriter out;
    by_one(with->self(), [&](const BodyPath& path) { write(out, path); });
    if (divided) part.write_paths(out);
    with->tell_all(std::move(out.bytes()));
    for (int p = 0; p < with->count(); ++p) {
        if (p == with->self()) continue;
        const Partners::Bytes heard = with->hear(p);
        ByteReader in(heard);
        by_one(p, [&](BodyPath& path) { read(in, path, settings.dt); });
        if (divided) part.read_paths(in, p);
        in.expect_end();
    }
    for (std::size_t i = 0; i < islands_used; ++i)
        for (const int id : islands[i].bodies) {
            BodyPath& path = contacts.paths()[static_cast<std::size_t>(id)];
            path.inertia = bodies[static_cast<std::size_t>(id)].kind->mass.inertia;
        }
}

void World::step_together(Partners& with) {
    implementation_->step_together(with);
}

}  // namespace sim
