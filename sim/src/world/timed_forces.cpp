#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

// Forces that a scene's schedule applies.

namespace sim {
namespace {

constexpr double kSlack = 1e-6;  // of a substep: times are not exact

int body_of(const ActiveForce& active) {
    return active.force->body;
}

}  // namespace

// Those that act within the step that begins, and wakes their bodies.
void World::Implementation::find_forces() {
    active.clear();
    const double substep = settings.dt / settings.substeps;
    const double begins = static_cast<double>(counts.steps - 1) * settings.substeps,
                 ends = begins + settings.substeps;
    for (const TimedForce& force : forces) {
        ActiveForce now{&force, force.from_s / substep, force.until_s / substep, 1};
        if (force.from_s == force.until_s) {
            now.from = std::floor(now.from + kSlack), now.until = now.from + 1;
            now.factor = 1 / substep;
        }
        if (now.from >= ends || now.until <= begins || force.body >= static_cast<int>(bodies.size()))
            continue;
        const MovingBody& body = bodies[static_cast<std::size_t>(force.body)];
        if (!body.moves()) continue;
        active.push_back(now);
        if (body.asleep && (body.own || sharing != Sharing::pairs)) wake_group(bodies, force.body);
    }
    for (const auto& solver : solvers) solver->begin_step(counts.steps - 1, active);
}

bool World::Implementation::is_forced(int body) const {
    return std::ranges::binary_search(active, body, {}, body_of);
}

void IslandSolver::begin_forces(int row) {
    const MovingBody& body = *rows_of_[static_cast<std::size_t>(row)].body;
    const auto on_it =
        std::ranges::equal_range(*forces_, static_cast<int>(&body - bodies_->data()), {}, body_of);
    if (on_it.empty()) return;
    pushed_.push_back({row,
                       {on_it.begin(), on_it.end()},
                       body.pushed,
                       body.force,
                       body.torque,
                       body.modal_force,
                       Eigen::Vector3d::Zero()});
}

// Of the substep that begins, beside the user's.
void IslandSolver::set_forces() {
    end_forces();
    const double begins = first_substep_ + substep_ + gone_, lasts = h_ * settings_->substeps / settings_->dt;
    for (Pushed& p : pushed_) {
        p.now.setZero();
        MovingBody& body = *rows_of_[static_cast<std::size_t>(p.row)].body;
        if (!p.pushed) body.force.setZero(), body.torque.setZero(), body.modal_force.setZero();
        body.pushed = true;
        for (const ActiveForce& active : p.forces) {
            const double overlap = std::min(active.until, begins + lasts) - std::max(active.from, begins);
            if (overlap <= 0) continue;
            const TimedForce& timed = *active.force;
            Eigen::Vector3d force = overlap / lasts * active.factor * timed.force;
            if (timed.turns) force = body.state.orientation * force;
            alignas(32) float shapes[3 * kMostModes];
            const End end = end_of(timed.body, timed.point, shapes);
            p.now += force;
            body.force += force;
            body.torque += (end.point - body.state.position).cross(force);
            if (!end.place.shapes) continue;
            const Eigen::Vector3d own = body.state.orientation.conjugate() * force;
            for (int k = 0; k < body.kind->modes; ++k)
                for (int axis = 0; axis < 3; ++axis)
                    body.modal_force[k] +=
                        static_cast<double>(shapes[axis * body.kind->mode_width + k]) * own[axis];
        }
    }
}

// Leaves the user's.
void IslandSolver::end_forces() {
    for (const Pushed& p : pushed_) {
        MovingBody& body = *rows_of_[static_cast<std::size_t>(p.row)].body;
        body.pushed = p.pushed;
        body.force = p.force, body.torque = p.torque, body.modal_force = p.modal_force;
    }
}

void IslandSolver::count_forces(double share) {
    for (const Pushed& p : pushed_)
        if (rows_of_[static_cast<std::size_t>(p.row)].body->own) outside_ += share * h_ * p.now;
}

}  // namespace sim
