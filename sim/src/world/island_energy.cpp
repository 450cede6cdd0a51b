#include <cmath>

#include "world/island_solver.h"

// The energy of an island over a step, and what it may not gain; see IslandSolver.

namespace sim {
namespace {

constexpr double kMostGained = 1e-7;  // energy in a step, of the motion's and of weight times size

}  // namespace

// What a solution is measured by, and taken back to.
void IslandSolver::note_start() {
    before_.resize(bodies_->size()), measures_.resize(rows_of_.size());
    outside_before_ = outside_, limited_before_ = limited_;
    each_body([this](BodyRows& rows) {
        const MovingBody& body = *rows.body;
        Before& before = before_[static_cast<std::size_t>(&body - bodies_->data())];
        before.state = body.state, before.at_limit = body.at_limit;
        measures_[static_cast<std::size_t>(&rows - rows_of_.data())] = measure(body);
    });
    note_springs();
    sum_start();
}

IslandSolver::Measure IslandSolver::measure(const MovingBody& body) const {
    const double speed = body.state.velocity.squaredNorm();
    const double weight = settings_->gravity.norm() * body.kind->half_box.minCoeff();
    return {energy_of(body), body.kind->mass.mass * (speed / 2 + weight), body.state.velocity.norm(),
            size_of(body)};
}

// In the order of ids.
void IslandSolver::sum_start() {
    energy_before_ = fastest_ = scale_ = 0, smallest_ = 1;
    for (const Measure& m : measures_) {
        energy_before_ += m.energy, scale_ += m.scale;
        fastest_ = std::max(fastest_, m.speed), smallest_ = std::min(smallest_, m.size);
    }
    for (const double e : springs_before_) energy_before_ += e;
}

void IslandSolver::go_back() {
    end_forces();
    for (const int id : island_->bodies) {
        MovingBody& body = (*bodies_)[static_cast<std::size_t>(id)];
        const Before& before = before_[static_cast<std::size_t>(id)];
        body.state = before.state, body.at_limit = before.at_limit, body.limited_now = false;
        body.was_given = false;
    }
    outside_ = outside_before_, limited_ = limited_before_;
    crossed_.resize(first_crossed_);
    begin(*island_);
}

// Bodies that only contacts and joints hold have no more energy after a step than before it: contacts that are found anew, and overlaps
// that are taken back, would give some at each step, and what leans would start to slide. What they got beyond kMostGained is
// taken from their motion against the rigid motion of them all, so that linear and angular momentum are kept; where
// that is not enough, it came from outside, and is taken from all of it. Not of bodies that others compute, too, at their own
// pace: what they were told stands.
bool IslandSolver::calm(double energy) {
    const double gained = energy - energy_before_;
    if (!(gained > kMostGained * scale_)) return false;
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), centre = momentum, turning = momentum;
    double mass = 0;
    for (const BodyRows& rows : rows_of_) {
        const double m = rows.body->kind->mass.mass;
        mass += m;
        momentum += m * rows.body->state.velocity;
        centre += m * rows.body->state.position;
    }
    Eigen::Vector3d velocity = momentum / mass, spin = Eigen::Vector3d::Zero();
    centre /= mass;
    auto inertia_of = [](const BodyRows& rows) -> Eigen::Matrix3d {
        const Eigen::Matrix3d turned = rows.body->state.orientation.toRotationMatrix();
        return turned * rows.body->kind->mass.inertia.asDiagonal() * turned.transpose();
    };
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    for (const BodyRows& rows : rows_of_) {
        const WorldBodyState& s = rows.body->state;
        const double m = rows.body->kind->mass.mass;
        const Eigen::Vector3d arm = s.position - centre;
        inertia +=
            inertia_of(rows) + m * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
        turning += s.angular_momentum + m * arm.cross(s.velocity);
    }
    spin = inertia.ldlt().solve(turning);
    auto common_of = [&](const BodyRows& rows) -> Eigen::Vector3d {
        return velocity + spin.cross(rows.body->state.position - centre);
    };
    auto motion = [&] {
        double sum = 0;
        for (const BodyRows& rows : rows_of_) {
            const WorldBodyState& s = rows.body->state;
            const Eigen::Vector3d own =
                s.orientation.conjugate() * (s.angular_momentum - inertia_of(rows) * spin);
            sum +=
                (rows.body->kind->mass.mass * (s.velocity - common_of(rows)).squaredNorm() +
                 own.cwiseAbs2().cwiseQuotient(rows.body->kind->mass.inertia).sum() + s.q_dot.squaredNorm()) /
                2;
        }
        return sum;
    };
    const bool enough = motion() >= gained;
    if (!enough) velocity.setZero(), spin.setZero();
    const double left = std::sqrt(std::max(0., 1 - gained / motion()));
    for (const BodyRows& rows : rows_of_) {
        WorldBodyState& s = rows.body->state;
        const Eigen::Vector3d common = common_of(rows), turn = inertia_of(rows) * spin;
        const Eigen::Vector3d change = (left - 1) * (s.velocity - common);
        s.velocity += change;
        if (!enough && rows.body->own) outside_ += rows.body->kind->mass.mass * change;
        s.angular_momentum = turn + left * (s.angular_momentum - turn);
        s.q_dot *= left;
    }
    return true;
}

// Kinetic and potential, with that of modes [J].
double IslandSolver::energy_of(const MovingBody& body) const {
    const WorldBodyState& s = body.state;
    const Eigen::Vector3d own = s.orientation.conjugate() * s.angular_momentum;
    const double mass = body.kind->mass.mass;
    return mass / 2 * s.velocity.squaredNorm() +
           own.cwiseAbs2().cwiseQuotient(body.kind->mass.inertia).sum() / 2 -
           mass * body.gravity_scale * settings_->gravity.dot(s.position) +
           (s.q_dot.squaredNorm() + s.q.cwiseProduct(body.kind->basis.omega).squaredNorm()) / 2;
}

// With that of springs [J], as of a direct solution or of sweeps; summed in the order of ids.
double IslandSolver::energy(bool directly) {
    each_body([this](BodyRows& rows) {
        measures_[static_cast<std::size_t>(&rows - rows_of_.data())].energy = energy_of(*rows.body);
    });
    double sum = 0;
    for (const Measure& m : measures_) sum += m.energy;
    for (const SpringRows& s : springs_) sum += energy_of(s, directly);
    return sum;
}

void IslandSolver::note_springs() {
    springs_before_.clear();
    for (const SpringRows& s : springs_) springs_before_.push_back(energy_of(s, direct_));
}

double IslandSolver::energy_of(const SpringRows& s, bool directly) const {
    const PointConstraint& held = s.constraint->definition;
    if (std::isinf(held.stiffness)) return 0;  // the ends are together
    auto end = [this](int id, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
        if (id < 0) return rest;
        const MovingBody& body = (*bodies_)[static_cast<std::size_t>(id)];
        Eigen::Vector3d point = rest;
        if (body.kind->modes > 0) {
            alignas(32) float shapes[3 * kMostModes];
            body.kind->shapes_at(rest.cast<float>(), shapes);
            for (int k = 0; k < 3 * body.kind->modes; ++k) {
                const int axis = k / body.kind->modes, mode = k % body.kind->modes;
                point[axis] +=
                    static_cast<double>(shapes[axis * body.kind->mode_width + mode]) * body.state.q[mode];
            }
        }
        return body.state.position + body.state.orientation * point;
    };
    // What velocity Verlet keeps exactly: with a spring softer by w / 4.
    const double kept = directly || !any_contacts_ ? 1 : 1 - h_ * h_ * held.stiffness * mobility_of(s) / 4;
    const Eigen::Quaterniond turned =
        held.body_b < 0 ? Eigen::Quaterniond::Identity()
                        : (*bodies_)[static_cast<std::size_t>(held.body_b)].state.orientation;
    return kept * held.stiffness / 2 *
           s.point->gap(end(held.body_a, s.point->a), end(held.body_b, s.point->b), turned).squaredNorm();
}

}  // namespace sim
