#include "solver/applied_forces.h"

#include <algorithm>

#include "solver/island_rows.h"

namespace sim {

void AppliedForces::begin() {
    pushed_.clear();
    for (std::size_t i = 0; i < rows_.bodies.size() && !active_->empty(); ++i) begin(i);
}

void AppliedForces::begin(std::size_t row) {
    const BodyRows& rows = rows_.bodies[row];
    const MovingBody& body = *rows.body;
    const auto on_it = std::ranges::equal_range(*active_, rows_.id_of(rows), {},
                                                [](const ActiveForce& active) { return active.force->body; });
    if (on_it.empty()) return;
    pushed_.push_back({static_cast<int>(row),
                       {on_it.begin(), on_it.end()},
                       body.pushed,
                       body.force,
                       body.torque,
                       body.modal_force,
                       Eigen::Vector3d::Zero()});
}

void AppliedForces::set() {
    end();
    const Substep& now = rows_.substep;
    const double begins = now.first + now.number + now.passed,
                 lasts = now.h * rows_.settings.substeps / rows_.settings.dt;
    for (Pushed& p : pushed_) {
        p.now.setZero();
        MovingBody& body = *rows_.bodies[static_cast<std::size_t>(p.row)].body;
        if (!p.pushed) body.force.setZero(), body.torque.setZero(), body.modal_force.setZero();
        body.pushed = true;
        for (const ActiveForce& active : p.forces) {
            const double overlap = std::min(active.until, begins + lasts) - std::max(active.from, begins);
            if (overlap <= 0) continue;
            const TimedForce& timed = *active.force;
            Eigen::Vector3d force = overlap / lasts * active.factor * timed.force;
            if (timed.turns) force = body.state.orientation * force;
            alignas(32) float shapes[3 * kMostModes];
            const IslandRows::End end_of_arm = rows_.end_of(timed.body, timed.point, shapes);
            p.now += force;
            body.force += force;
            body.torque += (end_of_arm.point - body.state.position).cross(force);
            if (!end_of_arm.place.shapes) continue;
            const Eigen::Vector3d own = body.state.orientation.conjugate() * force;
            for (int k = 0; k < body.kind->modes; ++k)
                for (int axis = 0; axis < 3; ++axis)
                    body.modal_force[k] +=
                        static_cast<double>(shapes[axis * body.kind->mode_width + k]) * own[axis];
        }
    }
}

void AppliedForces::end() {
    for (const Pushed& p : pushed_) {
        MovingBody& body = *rows_.bodies[static_cast<std::size_t>(p.row)].body;
        body.pushed = p.pushed;
        body.force = p.force, body.torque = p.torque, body.modal_force = p.modal_force;
    }
}

void AppliedForces::count(double share) {
    for (const Pushed& p : pushed_)
        if (rows_.bodies[static_cast<std::size_t>(p.row)].body->own)
            rows_.outside += share * rows_.substep.h * p.now;
}

}  // namespace sim
