#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "world/world_check.h"
#include "world/world_implementation.h"

namespace sim {
namespace {

constexpr double kStillTime = 0.5;  // [s]

void stop_body(MovingBody& body) {
    body.state.velocity.setZero();
    body.state.angular_momentum.setZero();
    body.state.q_dot.setZero();
}

}  // namespace

const BodyKind* World::Implementation::kind_of(const WorldBody& body) {
    for (const auto& kind : kinds)
        if (same_kind(kind->definition, body)) return kind.get();
    kinds.push_back(std::make_unique<BodyKind>(make_body_kind(body, settings)));
    return kinds.back().get();
}

int World::Implementation::add(const WorldBody& definition) {
    check_world_body(definition);
    MovingBody body;
    body.kind = kind_of(definition);
    body.fixed = !definition.moves();
    body.motion = definition.motion;
    body.gravity_scale = definition.gravity_scale;
    body.friction = static_cast<float>(definition.friction);
    body.restitution = static_cast<float>(definition.restitution);
    const Eigen::Quaterniond orientation(definition.world_from_body.rotation());
    const Eigen::Matrix3d r = orientation.toRotationMatrix();
    const Eigen::Vector3d momentum =
        r * body.kind->mass.inertia.cwiseProduct(r.transpose() * definition.angular_velocity);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(body.kind->modes);
    body.state = {definition.world_from_body.translation(),
                  orientation,
                  body.fixed ? Eigen::Vector3d::Zero() : definition.velocity,
                  body.fixed ? Eigen::Vector3d::Zero() : momentum,
                  zero,
                  zero};
    body.posed.kind = body.kind;
    body.substep_rotation = FreeRotation(body.kind->mass.inertia, settings.dt / settings.substeps);
    body.step_rotation = FreeRotation(body.kind->mass.inertia, settings.dt);
    body.modal_force = zero;
    body.given.modal = zero;
    definitions.push_back(definition);
    bodies.push_back(std::move(body));
    all_whole = false;
    definition.motion.empty() ? pose(bodies.back()) : place_driven(bodies.back());
    list_owned();
    return static_cast<int>(bodies.size()) - 1;
}

void World::Implementation::set_joined() {
    joined.clear();
    for (const HeldConstraint& c : constraints)
        if (c.holds && !c.collides)
            joined.emplace_back(std::min(c.definition.body_a, c.definition.body_b),
                                std::max(c.definition.body_a, c.definition.body_b));
    std::sort(joined.begin(), joined.end());
}

void World::Implementation::pose(MovingBody& body) {
    body.posed.set(body.state.position, body.state.orientation, body.state.q);
    body.unposed = false;
}

void World::Implementation::quarantine(int id, const std::string& what) {
    MovingBody& body = bodies[static_cast<std::size_t>(id)];
    body.quarantined = true;
    body.asleep = body.pushed = false;
    stop_body(body);  // where it was last seen whole
    body.state.position = body.posed.position;
    body.state.orientation = Eigen::Quaterniond(body.posed.rotation);
    body.state.q.setZero();
    if (body.own || sharing == Sharing::alone) quarantined.push_back({id, counts.steps, what});
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

// Bodies whose state or forces are not finite, or absurd, take no further part. Before anything else in a
// step, before they can touch another body.
void World::Implementation::quarantine_broken() {
    if (std::exchange(all_whole, true)) return;
    if (!any_broken([](const MovingBody& body) { return body.moves() && body.own; })) return;
    for (const int i : here) {
        const MovingBody& body = bodies[static_cast<std::size_t>(i)];
        if (!body.moves() || !body.own) continue;
        const std::string what = what_is_broken(body);
        if (!what.empty()) quarantine(i, what);
    }
    std::erase_if(here, [this](int i) { return bodies[static_cast<std::size_t>(i)].quarantined; });
}

template <typename Concerned>
bool World::Implementation::any_broken(Concerned concerned) {
    std::atomic<bool> any = false;
    crew().each(here.size(), kBodiesAPiece, [&](int, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            if (const MovingBody& body = bodies[static_cast<std::size_t>(here[i])];
                concerned(body) && !what_is_broken(body).empty())
                any.store(true, std::memory_order_relaxed);
    });
    return any;
}

// After a step: bodies that it broke, before any reader sees them.
void World::Implementation::quarantine_results() {
    // Asleep: not of an island that was solved.
    const bool any = any_broken([](const MovingBody& body) { return body.moves(); });
    for (std::size_t i = 0; i < islands_used; ++i) {
        if (!is_own(islands[i])) continue;
        for (const int id : islands[i].bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            body.pushed = false;
            if (!any || (sharing == Sharing::pairs && !body.own)) continue;  // its owner's affair
            const std::string what = what_is_broken(body);
            if (!what.empty()) quarantine(id, what);
        }
    }
}

bool World::Implementation::is_own(const Island& island) const {
    if (sharing == Sharing::alone) return !island.bodies.empty();
    return std::any_of(island.bodies.begin(), island.bodies.end(),
                       [this](int id) { return bodies[static_cast<std::size_t>(id)].own; });
}

void World::Implementation::gather() {
    if (sharing == Sharing::pairs) return gather_pairs();
    here.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i)
        if (!bodies[i].quarantined) here.push_back(static_cast<int>(i));
}

void World::Implementation::find_islands() {
    sets.reset(bodies.size());
    auto moves = [this](int id) {
        return id >= 0 && id < kFirstPlane && bodies[static_cast<std::size_t>(id)].moves();
    };
    // What broke since the step began joins until it ends: an island that is solved again begins as it was.
    auto held_here = [&](std::size_t constraint) {
        const HeldConstraint& c = constraints[constraint];
        const int a = c.definition.body_a, b = c.definition.body_b;
        const bool away =
            sharing == Sharing::pairs && !bodies[static_cast<std::size_t>(moves(a) ? a : std::max(b, 0))].own;
        return (solving ? springs_before[constraint].holds : c.holds) && !away;
    };
    auto is_here = [this](int id) {
        return sharing == Sharing::alone || std::binary_search(here.begin(), here.end(), id);
    };
    const auto& manifolds = contacts.manifolds();
    touching.resize(manifolds.size());
    crew().each(touching.size(), 4 * kBodiesAPiece, [&](int, std::size_t first, std::size_t end) {
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
    for (const int i : here)
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

void World::Implementation::tell_broken(std::uint64_t broken_before) {
    if (counts.constraints_broken == broken_before) return;
    for (std::size_t c = 0; c < constraints.size(); ++c)
        if (held_before[c] != 0 && !constraints[c].holds)
            broken.push_back({static_cast<int>(c), counts.steps});
}

void World::Implementation::tell_limited(std::uint64_t limited_before) {
    if (counts.deformations_limited == limited_before) return;
    for (const int i : here) {
        MovingBody& body = bodies[static_cast<std::size_t>(i)];
        const bool now = std::exchange(body.limited_now, false);
        if (!now || !body.own || body.limited_step != 0) continue;
        body.limited_step = counts.steps;
        limited.push_back({i, counts.steps});
    }
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
            if (sharing == Sharing::pairs) still = still && body.own && !body.pushed;
        }
        if (!still || (!is_held(island) && drifts(island))) continue;
        for (const int id : island.bodies) {
            MovingBody& body = bodies[static_cast<std::size_t>(id)];
            if (body.own) outside -= body.kind->mass.mass * body.state.velocity;
            body.asleep = true;
            body.sleep_group = island.bodies.front();
            stop_body(body);
            pose(body);
        }
    }
}

void World::Implementation::count_work() {
    for (const int i : here) {
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
        const bool shared = own(m.a) && own(m.b) && both;
        if (own(m.a)) bodies[static_cast<std::size_t>(m.a)].work += shared ? work / 2 : work;
        if (own(m.b)) bodies[static_cast<std::size_t>(m.b)].work += shared ? work / 2 : work;
    }
}

// Whether anything happens in this step.
bool World::Implementation::any_awake() const {
    return std::any_of(here.begin(), here.end(), [this](int i) {
        const MovingBody& body = bodies[static_cast<std::size_t>(i)];
        return body.travels || (body.moves() && !body.asleep);
    });
}

void World::Implementation::set_threads(std::unique_ptr<Crew> crew) {
    all = std::move(crew);
    while (solvers.size() < static_cast<std::size_t>(all->size())) {
        solvers.push_back(
            std::make_unique<IslandSolver>(settings, bodies, contacts.manifolds(), constraints));
        solvers.back()->record(&contacts.paths());
    }
}

void World::Implementation::step() {
    const FlushDenormals flush;
    solving = false;
    solver().cross(sharing == Sharing::pairs);
    outside_before = outside;
    ++counts.steps;
    begin_motions();
    find_forces();
    gather();
    quarantine_broken();
    for (const int i : here)
        if (bodies[static_cast<std::size_t>(i)].pushed && bodies[static_cast<std::size_t>(i)].asleep)
            wake_group(bodies, i);
    counts.contacts = counts.pairs = counts.islands = 0;
    if (!any_awake()) {
        end_motions();
        return dismiss_ghosts();
    }
    crew().each(here.size(), 16, [this](int, std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            MovingBody& body = bodies[static_cast<std::size_t>(here[i])];
            body.was_given = false;
            if (!body.moves() || (body.asleep && !body.unposed)) continue;
            pose(body);
        }
    });
    const auto [fallbacks_before, impacts_before] = std::pair(contacts.fallbacks(), contacts.impacts());
    contacts.find(contact_scene(crew()));
    find_islands();
    held_before.resize(constraints.size());
    for (std::size_t c = 0; c < constraints.size(); ++c) held_before[c] = constraints[c].holds;
    const auto [limited_before, broken_before] =
        std::pair(counts.deformations_limited, counts.constraints_broken);
    solve_islands();
    tell_broken(broken_before);
    tell_limited(limited_before);
    put_to_sleep();
    count_work();
    quarantine_results();
    end_motions();
    dismiss_ghosts();
    counts.pairs = contacts.pairs();
    counts.inverse_fallbacks += contacts.fallbacks() - fallbacks_before;
    counts.impacts += contacts.impacts() - impacts_before;
    counts.asleep = static_cast<int>(
        std::count_if(bodies.begin(), bodies.end(), [](const MovingBody& b) { return b.asleep; }));
}

World::World(const WorldDefinition& definition) : implementation_(std::make_unique<Implementation>()) {
    check_world(definition);
    Implementation& w = *implementation_;
    w.settings = definition.settings;
    w.planes = definition.planes;
    w.set_threads(std::make_unique<Crew>());
    w.forces = definition.forces;
    std::ranges::stable_sort(w.forces, {}, &TimedForce::body);
    for (const WorldBody& body : definition.bodies) w.add(body);
    for (const PointConstraint& constraint : definition.constraints) add_constraint(constraint);
}

void World::use_threads(int threads) {
    if (threads < 1)
        throw std::invalid_argument("threads: found " + std::to_string(threads) + ", expected 1 or more");
    implementation_->set_threads(std::make_unique<Crew>(threads));
}

void World::plan_threads(int threads) {
    if (threads < 1)
        throw std::invalid_argument("threads: found " + std::to_string(threads) + ", expected 1 or more");
    implementation_->set_threads(std::make_unique<Crew>(ThreadPlan(threads)));
}

double World::saved_by_threads_s() const {
    const ThreadPlan* plan = implementation_->all->plan();
    return plan ? plan->saved_s() : 0;
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

void World::step() {
    implementation_->step();
}

int World::add_body(const WorldBody& body) {
    return implementation_->add(body);
}

int World::add_constraint(const PointConstraint& constraint) {
    Implementation& w = *implementation_;
    check_constraint(constraint, bodies());
    auto kind = [&w](int body) { return w.bodies[static_cast<std::size_t>(body)].kind; };
    w.constraints.push_back(held_constraint(constraint, *kind(constraint.body_a),
                                            constraint.body_b < 0 ? nullptr : kind(constraint.body_b)));
    w.set_joined();
    for (const int body : {constraint.body_a, constraint.body_b})
        if (body >= 0) wake(body);
    return static_cast<int>(w.constraints.size()) - 1;
}

void World::remove_constraint(int id) {
    Implementation& w = *implementation_;
    HeldConstraint& constraint = w.constraints.at(static_cast<std::size_t>(id));
    constraint.holds = false;
    w.set_joined();
    for (const int body : {constraint.definition.body_a, constraint.definition.body_b})
        if (body >= 0) wake(body);
}

bool World::constraint_holds(int id) const {
    return implementation_->constraints.at(static_cast<std::size_t>(id)).holds;
}

const WorldSettings& World::settings() const noexcept {
    return implementation_->settings;
}

int World::bodies() const noexcept {
    return static_cast<int>(implementation_->bodies.size());
}

const WorldBody& World::definition(int body) const {
    return implementation_->definitions.at(static_cast<std::size_t>(body));
}

FidelityChoice World::fidelity(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).kind->choice;
}

RigidMass World::rigid_mass(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).kind->mass;
}

const ModalBasis& World::basis(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).kind->basis;
}

WorldBodyState World::state(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).state;
}

void World::set_state(int body, const WorldBodyState& state) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    check_state(state, b.kind->modes, b.fixed);
    b.state = state;
    implementation_->all_whole = false;
    const double norm = state.orientation.norm();
    if (norm > 0.5 && norm < 2) b.state.orientation.coeffs() /= norm;
    if (b.fixed) {
        stop_body(b);
        implementation_->pose(b);
    }
    wake(body);
}

void World::apply_force(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& point_body) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    if (b.unposed) implementation_->pose(b);
    if (!b.pushed) b.force.setZero(), b.torque.setZero(), b.modal_force.setZero();
    const Eigen::Matrix3d r = b.state.orientation.toRotationMatrix();
    b.pushed = true;
    implementation_->all_whole = false;
    b.force += force;
    b.torque += (r * b.posed.deformed(point_body)).cross(force);
    if (b.kind->modes > 0)
        b.modal_force += mode_shapes_at(b.kind->basis, point_body).transpose() * (r.transpose() * force);
}

void World::wake(int body) {
    Implementation& w = *implementation_;
    if (w.bodies.at(static_cast<std::size_t>(body)).asleep) wake_group(w.bodies, body);
    w.bodies[static_cast<std::size_t>(body)].still_steps = 0;
}

bool World::asleep(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).asleep;
}

bool World::all_asleep() const {
    const auto& bodies = implementation_->bodies;
    return std::all_of(bodies.begin(), bodies.end(),
                       [](const MovingBody& b) { return b.asleep || !b.moves(); });
}

double World::time_s() const noexcept {
    return static_cast<double>(implementation_->counts.steps) * implementation_->settings.dt;
}

const WorldCounts& World::counts() const noexcept {
    return implementation_->counts;
}

const std::vector<QuarantinedBody>& World::quarantined() const noexcept {
    return implementation_->quarantined;
}

const std::vector<FirstStep>& World::limited() const noexcept {
    return implementation_->limited;
}

const std::vector<FirstStep>& World::broken() const noexcept {
    return implementation_->broken;
}

}  // namespace sim
