#include "solver/energy_balance.h"

#include <cmath>

namespace sim {
namespace {

// [energy of motion and of weight times size] An island's gain in a step that is rounding. More: heaps creep and simmer; less:
// rounding is taken for a gain, and free motion is braked.
constexpr double kMostGained = 1e-7;

}  // namespace

void EnergyBalance::note_start() {
    states_.resize(rows_.world.size()), measures_.resize(rows_.bodies.size());
    outside_ = rows_.outside, limited_ = rows_.limited;
    rows_.each_body([this](BodyRows& rows) {
        const MovingBody& body = *rows.body;
        Before& before = states_[static_cast<std::size_t>(rows_.id_of(rows))];
        before.state = body.state, before.at_limit = body.at_limit;
        measures_[static_cast<std::size_t>(&rows - rows_.bodies.data())] = measure(body);
    });
    // In the order of ids.
    before_ = fastest_ = scale_ = 0, smallest_ = 1;
    for (const Measure& m : measures_) {
        before_ += m.energy, scale_ += m.scale;
        fastest_ = std::max(fastest_, m.speed), smallest_ = std::min(smallest_, m.size);
    }
    for (const SpringRows& s : rows_.springs) before_ += energy_of(s, rows_.directly);
}

EnergyBalance::Measure EnergyBalance::measure(const MovingBody& body) const {
    const double speed = body.state.velocity.squaredNorm();
    const double weight = rows_.settings.gravity.norm() * body.kind->half_box.minCoeff();
    return {energy_of(body), body.kind->mass.mass * (speed / 2 + weight), body.state.velocity.norm(),
            2 * body.kind->half_box.minCoeff()};
}

void EnergyBalance::go_back() {
    for (const BodyRows& rows : rows_.bodies) {
        MovingBody& body = *rows.body;
        const Before& before = states_[static_cast<std::size_t>(rows_.id_of(rows))];
        body.state = before.state, body.at_limit = before.at_limit, body.limited_now = false;
        body.was_given = false;
    }
    rows_.outside = outside_, rows_.limited = limited_;
    rows_.cross.go_back();
}

void EnergyBalance::take_gain(double energy_now) {
    const double gained = energy_now - before_;
    if (!(gained > kMostGained * scale_)) return;
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), centre = momentum, turning = momentum;
    double mass = 0;
    for (const BodyRows& rows : rows_.bodies) {
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
    for (const BodyRows& rows : rows_.bodies) {
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
        for (const BodyRows& rows : rows_.bodies) {
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
    for (const BodyRows& rows : rows_.bodies) {
        WorldBodyState& s = rows.body->state;
        const Eigen::Vector3d common = common_of(rows), turn = inertia_of(rows) * spin;
        const Eigen::Vector3d change = (left - 1) * (s.velocity - common);
        s.velocity += change;
        if (!enough && rows.body->own) rows_.outside += rows.body->kind->mass.mass * change;
        s.angular_momentum = turn + left * (s.angular_momentum - turn);
        s.q_dot *= left;
    }
}

// Kinetic and potential, with that of modes [J].
double EnergyBalance::energy_of(const MovingBody& body) const {
    const WorldBodyState& s = body.state;
    const Eigen::Vector3d own = s.orientation.conjugate() * s.angular_momentum;
    const double mass = body.kind->mass.mass;
    return mass / 2 * s.velocity.squaredNorm() +
           own.cwiseAbs2().cwiseQuotient(body.kind->mass.inertia).sum() / 2 -
           mass * body.gravity_scale * rows_.settings.gravity.dot(s.position) +
           (s.q_dot.squaredNorm() + s.q.cwiseProduct(body.kind->basis.omega).squaredNorm()) / 2;
}

// With that of springs [J], as of a direct solution or of sweeps; summed in the order of ids.
double EnergyBalance::energy(bool directly) {
    rows_.each_body([this](BodyRows& rows) {
        measures_[static_cast<std::size_t>(&rows - rows_.bodies.data())].energy = energy_of(*rows.body);
    });
    double sum = 0;
    for (const Measure& m : measures_) sum += m.energy;
    for (const SpringRows& s : rows_.springs) sum += energy_of(s, directly);
    return sum;
}

double EnergyBalance::energy_of(const SpringRows& s, bool directly) const {
    const PointConstraint& held = s.constraint->definition;
    if (std::isinf(held.stiffness)) return 0;  // the ends are together
    auto end = [this](int id, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
        if (id < 0) return rest;
        const MovingBody& body = rows_.world[static_cast<std::size_t>(id)];
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
    const double kept = directly || !rows_.any_contacts
                            ? 1
                            : 1 - rows_.substep.h * rows_.substep.h * held.stiffness * mobility_of(s) / 4;
    const Eigen::Quaterniond turned =
        held.body_b < 0 ? Eigen::Quaterniond::Identity()
                        : rows_.world[static_cast<std::size_t>(held.body_b)].state.orientation;
    return kept * held.stiffness / 2 *
           s.point->gap(end(held.body_a, s.point->a), end(held.body_b, s.point->b), turned).squaredNorm();
}

}  // namespace sim
