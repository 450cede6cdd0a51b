#include "world/step_records.h"
#include "world/world_implementation.h"

// A step by several partners (partners.h): each finds the contacts of its bodies and solves some of the small islands
// (plan_islands), and all sweep a part of each large one (island_partners.cpp). What is found and solved they tell each other, with
// energies, so that the worlds are the same again. Islands and sleep each finds for itself, as if alone.
//
// A partner that does not go on with the others goes back to where the step began; what changed by then is known.

namespace sim {

bool World::Implementation::is_by_one(const Island& island) const {
    return island.bodies.size() < kLeastDivided;
}

void World::Implementation::step_together(Partners& partners) {
    owned_by_this.clear(), sleep_before.clear();
    for (MovingBody& body : bodies) {
        owned_by_this.push_back(std::exchange(body.own, true));  // all of the world counts
        sleep_before.push_back({body.asleep, body.still_steps, body.sleep_group});
    }
    const WorldCounts counts_before = counts;
    with = partners.count() > 1 ? &partners : nullptr;
    divided.clear();
    try {
        step();
    } catch (...) {
        with = nullptr;
        go_back(counts_before);
        restore_own();
        throw;
    }
    restore_own();
}

void World::Implementation::restore_own() noexcept {
    for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].own = owned_by_this[i] != 0;
    owned_by_this.clear();
}

// Others are heard from when contacts are being found or islands solved. (What is quarantined by then would be again.)
void World::Implementation::go_back(const WorldCounts& counts_before) {
    for (const auto& solver : solvers) solver->give_up();
    contacts.go_back();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        MovingBody& body = bodies[i];
        if (solving && noted[i] != 0) body.state = started[i], body.at_limit = at_limit_before[i] != 0;
        body.limited_now = false;
        body.asleep = sleep_before[i].asleep && !body.quarantined;
        body.still_steps = sleep_before[i].still_steps, body.sleep_group = sleep_before[i].group;
    }
    bool changed = false;
    for (const SpringRecord& spring : springs_before)
        if (solving) changed = restore_spring(spring) || changed;
    if (changed) set_joined();
    counts = counts_before, outside = outside_before;
    end_motions();
    all_whole = false;
}

// In a box about all of this partner's.
void World::Implementation::find_near() {
    constexpr double kRounding = 1.001;  // poses are in single precision
    const auto ball_of = [this](int id) {
        const MovingBody& body = bodies[static_cast<std::size_t>(id)];
        // A sleeper may be woken, and falls then.
        const double falls =
            body.asleep ? settings.dt * settings.dt * std::abs(body.gravity_scale) * settings.gravity.norm()
                        : 0;
        const double radius =
            kRounding * (loose_radius(*body.kind, body.state.q) + contact_reach(body, settings) + falls);
        return Eigen::AlignedBox3d((body.state.position.array() - radius).matrix(),
                                   (body.state.position.array() + radius).matrix());
    };
    Eigen::AlignedBox3d own;
    near.assign(bodies.size(), 0);
    for (const int id : here)
        if (with->of(id) == with->self() && bodies[static_cast<std::size_t>(id)].moves()) {
            near[static_cast<std::size_t>(id)] = 1;
            own.extend(ball_of(id));
        }
    for (const int id : here)
        if (std::uint8_t& is_near = near[static_cast<std::size_t>(id)];
            is_near == 0 && bodies[static_cast<std::size_t>(id)].moves())
            is_near = !own.isEmpty() && own.intersects(ball_of(id));
}

// What the islands of own constraints took in the last step: from it all plan alike.
void World::Implementation::write_efforts(ByteWriter& out) const {
    for (std::size_t c = 0; c < constraints.size(); ++c)
        if (with->of(constraints[c].definition.body_a) == with->self()) out.number(effort[c]);
}

void World::Implementation::read_efforts(ByteReader& in, int partner) {
    for (std::size_t c = 0; c < constraints.size(); ++c)
        if (with->of(constraints[c].definition.body_a) == partner)
            effort_told[c] = std::max(read_finite(in), 0.);
}

void World::Implementation::pose_the_rest() {
    for (const int id : here) {
        MovingBody& body = bodies[static_cast<std::size_t>(id)];
        if (!body.unposed || !body.moves()) continue;
        const WorldBodyState& s = body.asleep ? body.state : started[static_cast<std::size_t>(id)];
        body.posed.set(s.position, s.orientation, s.q);
        body.unposed = false;
    }
}

IslandSolver& World::Implementation::part_solver(std::size_t part) {
    while (solvers.size() < part + 2) {
        solvers.push_back(
            std::make_unique<IslandSolver>(settings, bodies, contacts.manifolds(), constraints));
        solvers.back()->record(&contacts.paths());
    }
    IslandSolver& solver = *solvers[part + 1];
    solver.begin_step(counts.steps - 1, active);
    return solver;
}

// What solving an island takes, about, in units of World::work: only shares matter.
double World::Implementation::cost_of(const Island& island) const {
    double cost = 1 + static_cast<double>(island.bodies.size());
    for (const int m : island.manifolds)
        cost += kWorkOfPoint * contacts.manifolds()[static_cast<std::size_t>(m)].count;
    for (const int c : island.constraints) cost += effort_told[static_cast<std::size_t>(c)];
    return cost;
}

// Who solves which of the small islands: whose first body it is, but the dearest go, one by one, to those with most left of
// their share, which the bodies that they own tell. Leaves the rest of the shares for large islands.
void World::Implementation::plan_islands() {
    const auto partners = static_cast<std::size_t>(with->count());
    std::vector<double>&share = spare, load(partners, 0);
    share.assign(partners, 0);
    solved_by.resize(bodies.size());
    double all_cost = 0, owned_bodies = 0;
    dear.clear();
    std::vector<double> costs;
    for (const Island* island : to_solve) {
        costs.push_back(cost_of(*island));
        all_cost += costs.back();
        for (const int id : island->bodies) ++share[static_cast<std::size_t>(with->of(id))];
        owned_bodies += static_cast<double>(island->bodies.size());
    }
    for (double& s : share) s *= all_cost / owned_bodies;
    for (std::size_t i = 0; i < to_solve.size(); ++i) {
        if (!is_by_one(*to_solve[i])) continue;
        int& by = solved_by[static_cast<std::size_t>(to_solve[i]->bodies.front())];
        by = with->of(to_solve[i]->bodies.front());
        if (costs[i] > all_cost / static_cast<double>(8 * partners))
            dear.emplace_back(costs[i], to_solve[i]);
        else
            load[static_cast<std::size_t>(by)] += costs[i];
    }
    for (std::size_t p = 0; p < partners; ++p) spare[p] = share[p] - load[p];
    std::ranges::stable_sort(dear, std::greater<>(), [](const auto& d) { return d.first; });
    for (const auto& [cost, island] : dear) {
        const auto most = std::ranges::max_element(spare);
        solved_by[static_cast<std::size_t>(island->bodies.front())] = static_cast<int>(most - spare.begin());
        *most -= cost;
    }
    for (double& s : spare) s = std::max(s, 0.);
    solves.resize(partners);
    for (auto& islands_of : solves) islands_of.clear();
    for (const Island* island : to_solve)
        if (is_by_one(*island)) solves[static_cast<std::size_t>(solver_of(*island))].push_back(island);
}

void World::Implementation::solve_together(const Solve& solve, bool first) {
    plan_islands();
    divided.clear();
    bool breaks = false;
    const auto check = [&](int id) {
        breaks = breaks || !what_is_broken(bodies[static_cast<std::size_t>(id)]).empty();
    };
    const auto note = [this](int id) { note_started(id); };
    IslandSolver& one = solver();
    const ContactScene scene = contact_scene(alone);
    ByteWriter out;
    for (const Island* island : to_solve) {
        if (is_by_one(*island)) continue;
        IslandSolver& part = part_solver(divided.size());
        if (first && part.begin_together(*island, scene, *with, spare, note)) {
            divided.push_back({island, &part});
            if (with->self() >= 0) part.write_part(out);
            if (with->self() >= 0) part.each_id_of(with->self(), check);
        } else {
            std::ranges::for_each(island->bodies, note);
            solve(*island, one, scene);
            std::ranges::for_each(island->bodies, check);
        }
    }
    if (with->self() >= 0)
        for (const Island* island : solves[static_cast<std::size_t>(with->self())]) {
            std::ranges::for_each(island->bodies, note);
            solve(*island, one, scene);
            std::ranges::for_each(island->bodies, check);
            write_result(out, *island);
        }
    with->tell_all(std::move(out.bytes()));
    for (int p = 0; p < with->count(); ++p) {
        if (p == with->self()) continue;
        ByteReader in(contacts.keep(with->hear(p)));
        for (const Divided& d : divided) {
            d.part->each_id_of(p, [this](int id) { note_before_reading(id); });
            d.part->read_part(in, p);
            d.part->each_id_of(p, check);
        }
        for (const Island* island : solves[static_cast<std::size_t>(p)]) {
            read_result(in, *island);
            std::ranges::for_each(island->bodies, check);
        }
        in.expect_end();
    }
    results_checked = first && !breaks;
    std::erase_if(divided, [&](const Divided& d) { return !end_divided(d, solve, scene); });
}

// Whether it is solved by that.
bool World::Implementation::end_divided(const Divided& d, const Solve& solve, const ContactScene& scene) {
    const std::uint64_t limits = d.part->deformations_limited(), breaks = d.part->constraints_broken();
    if (!d.part->end_together()) {  // it has to be solved directly: by each, from its start
        begin_again(*d.island);
        results_checked = false;
        solve(*d.island, solver(), scene);
        return false;
    }
    if (d.part->calmed()) results_checked = false;
    Outcome& outcome = outcomes[static_cast<std::size_t>(d.island->bodies.front())];
    outcome = {};
    outcome.limited = limits - d.part->limited_before();
    outcome.broken = d.part->constraints_broken() - breaks;
    outcome.outside = d.part->take_outside_impulse();
    for (const int id : d.island->bodies) solved[static_cast<std::size_t>(id)] = 1;
    for (const int c : d.island->constraints) effort[static_cast<std::size_t>(c)] = 0;
    return true;
}

void World::Implementation::write_result(ByteWriter& out, const Island& island) const {
    for (const int id : island.bodies) write(out, bodies[static_cast<std::size_t>(id)]);
    const Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    out.number(outcome.limited), out.number(outcome.broken);
    out.matrix(outcome.outside);
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
        out.number(effort[static_cast<std::size_t>(c)]);
        for (const HeldPoint& point : held.points) write_floats(out, {point.impulse.data(), 3});
    }
}

void World::Implementation::read_result(ByteReader& in, const Island& island) {
    for (const int id : island.bodies) {
        note_before_reading(id);
        read(in, bodies[static_cast<std::size_t>(id)]);
    }
    Outcome& outcome = outcomes[static_cast<std::size_t>(island.bodies.front())];
    outcome.carried = solver().is_carried(island);
    outcome.limited = in.number<std::uint64_t>(), outcome.broken = in.number<std::uint64_t>();
    for (double& p : outcome.outside) p = read_finite(in);
    const bool by_solver = in.flag();
    if (by_solver)
        for (const int id : island.bodies) solved[static_cast<std::size_t>(id)] = 1;
    outcome.found = in.flag();
    if (outcome.found) {
        outcome.manifolds.resize(in.count(22));
        for (Manifold& m : outcome.manifolds) read(in, m, bodies, planes.size()), unpack(m);
    }
    for (const int m : island.manifolds) read_impulses(in, contacts.manifolds()[static_cast<std::size_t>(m)]);
    for (const int c : island.constraints) {
        HeldConstraint& held = constraints[static_cast<std::size_t>(c)];
        held.holds = in.flag();
        effort[static_cast<std::size_t>(c)] = read_finite(in);
        for (HeldPoint& point : held.points) read_floats(in, {point.impulse.data(), 3});
    }
}

// Of all bodies that were solved: some left theirs, and may meet any.
void World::Implementation::share_paths() {
    pose_the_rest();
    auto by_one = [&](int partner, const auto& visit) {
        for (std::size_t i = 0; i < islands_used; ++i) {
            const Island& island = islands[i];
            if (!is_by_one(island) || solver_of(island) != partner ||
                solved[static_cast<std::size_t>(island.bodies.front())] == 0)
                continue;
            for (const int id : island.bodies) visit(contacts.paths()[static_cast<std::size_t>(id)]);
        }
    };
    ByteWriter out;
    by_one(with->self(), [&](const BodyPath& path) { write(out, path); });
    for (const Divided& d : divided)
        if (with->self() >= 0) d.part->write_paths(out);
    with->tell_all(std::move(out.bytes()));
    for (int p = 0; p < with->count(); ++p) {
        if (p == with->self()) continue;
        const Partners::Bytes heard = with->hear(p);
        ByteReader in(heard);
        by_one(p, [&](BodyPath& path) { read(in, path, settings.dt); });
        for (const Divided& d : divided) d.part->read_paths(in, p);
        in.expect_end();
    }
    for (std::size_t i = 0; i < islands_used; ++i)
        for (const int id : islands[i].bodies) {
            BodyPath& path = contacts.paths()[static_cast<std::size_t>(id)];
            path.inertia = bodies[static_cast<std::size_t>(id)].kind->mass.inertia;
        }
}

}  // namespace sim
