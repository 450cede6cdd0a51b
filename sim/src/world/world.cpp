#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "world/world_check.h"
#include "world/world_implementation.h"

namespace sim {

const BodyKind* World::Implementation::kind_of(const WorldBody& body) {
    for (const auto& kind : kinds)
        if (same_kind(kind->definition, body)) return kind.get();
    kinds.push_back(std::make_unique<BodyKind>(make_body_kind(body, settings)));
    return kinds.back().get();
}

int World::Implementation::add(const WorldBody& definition) {
    check_world_body(definition);
    MovingBody body = moving_body(definition, *kind_of(definition), settings);
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

void World::Implementation::make_solvers() {
    while (solvers.size() < static_cast<std::size_t>(crew->size())) {
        solvers.push_back(std::make_unique<IslandSolver>(settings, bodies, contacts.manifolds(), constraints,
                                                         contacts.paths()));
    }
}

World::World(const WorldDefinition& definition) : implementation_(std::make_unique<Implementation>()) {
    check_world(definition);
    Implementation& w = *implementation_;
    w.settings = definition.settings;
    w.planes = definition.planes;
    w.make_solvers();
    w.forces = definition.forces;
    std::ranges::stable_sort(w.forces, {}, &TimedForce::body);
    for (const WorldBody& body : definition.bodies) w.add(body);
    for (const PointConstraint& constraint : definition.constraints) add_constraint(constraint);
}

void World::use_threads(int threads) {
    if (threads < 1)
        throw std::invalid_argument("threads: found " + std::to_string(threads) + ", expected 1 or more");
    implementation_->crew = std::make_unique<Crew>(threads);
    implementation_->make_solvers();
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
        b.stop();
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
