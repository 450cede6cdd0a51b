#pragma once
#include <deque>
#include <memory>

#include "solver/applied_forces.h"
#include "solver/island_rows.h"
#include "world_bodies.h"

/// One island for tests of the solver's parts: all bodies that move, with contacts found as in a world's step.
struct SolverIsland {
    /// Bodies and planes of a definition, as its first step begins.
    explicit SolverIsland(const sim::WorldDefinition& definition)
        : settings(definition.settings), planes(definition.planes) {
        for (std::size_t i = 0; i < definition.bodies.size(); ++i) {
            kinds.push_back(sim::make_body_kind(definition.bodies[i], settings));
            bodies.push_back(sim::moving_body(definition.bodies[i], kinds[i], settings));
            participants.push_back(static_cast<int>(i));
            if (bodies.back().moves()) island.bodies.push_back(static_cast<int>(i));
        }
        for (sim::MovingBody& body : bodies)
            body.posed.set(body.state.position, body.state.orientation, body.state.q);
        for (const sim::PointConstraint& c : definition.constraints) {
            const auto kind = [&](int id) { return id < 0 ? nullptr : &kinds[std::size_t(id)]; };
            island.constraints.push_back(int(constraints.size()));
            constraints.push_back(sim::held_constraint(c, *kind(c.body_a), kind(c.body_b)));
            if (!constraints.back().collides) joined.emplace_back(c.body_a, c.body_b);
        }
        contacts.find(scene);
        for (std::size_t m = 0; m < contacts.manifolds().size(); ++m) island.manifolds.push_back(int(m));
    }
    SolverIsland(const SolverIsland&) = delete;
    SolverIsland& operator=(const SolverIsland&) = delete;

    /// The rows of the island, as its step begins.
    sim::IslandRows& begin() {
        rows = std::make_unique<sim::IslandRows>(settings, bodies, contacts.manifolds(), constraints,
                                                 contacts.paths());
        rows->begin(island, scene);
        return *rows;
    }
    [[nodiscard]] Eigen::Vector3d momentum() const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const sim::MovingBody& b : bodies) sum += b.kind->mass.mass * b.state.velocity;
        return sum;
    }
    [[nodiscard]] Eigen::Vector3d angular_momentum() const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const sim::MovingBody& b : bodies)
            sum += b.state.angular_momentum + b.kind->mass.mass * b.state.position.cross(b.state.velocity);
        return sum;
    }
    [[nodiscard]] double kinetic_energy() const {
        double sum = 0;
        for (const sim::MovingBody& b : bodies) {
            const Eigen::Vector3d own = b.state.orientation.conjugate() * b.state.angular_momentum;
            sum += b.kind->mass.mass / 2 * b.state.velocity.squaredNorm() +
                   own.cwiseAbs2().cwiseQuotient(b.kind->mass.inertia).sum() / 2;
        }
        return sum;
    }

    sim::WorldSettings settings;
    std::vector<sim::WorldPlane> planes;
    std::deque<sim::BodyKind> kinds;
    std::vector<sim::MovingBody> bodies;
    std::vector<sim::HeldConstraint> constraints;
    std::vector<std::pair<int, int>> joined;
    std::vector<int> participants;
    sim::Crew crew;
    sim::StepContacts contacts;
    sim::ContactScene scene{settings, planes, joined, bodies, participants, false, crew};
    sim::Island island;
    std::unique_ptr<sim::IslandRows> rows;
    std::vector<sim::ActiveForce> no_forces;
};
