#include "world/world_check.h"

#include <cmath>
#include <sstream>

#include "sim/errors.h"

namespace sim {
namespace {

constexpr double kFurthest = 1e7, kFastest = 1e6, kStrongest = 1e8;  // m, m/s, m/s^2
constexpr double kLargestForce = 1e15, kLongest = 1e9;               // N, s

[[noreturn]] void refuse(const std::string& who, const std::string& what, double found,
                         const std::string& expected) {
    std::ostringstream number;
    number << found;
    throw InputError(who + ": " + what, number.str(), expected);
}

void check_range(const std::string& who, const std::string& what, double value, double low, double high) {
    if (value >= low && value <= high) return;
    std::ostringstream expected;
    expected << low << " to " << high;
    refuse(who, what, value, expected.str());
}

void check_vector(const std::string& who, const std::string& what, const Eigen::Vector3d& v, double most) {
    for (int i = 0; i < 3; ++i) check_range(who, what, v[i], -most, most);
}

void check_shape(const std::string& who, const GeneralizedSuperquadric& shape) {
    for (int i = 0; i < 3; ++i) check_range(who, "semi-axis [m]", shape.base.semi_axes[i], 1e-4, 1e3);
    check_range(who, "exponent e1", shape.base.e1, 0.1, 1.9);
    check_range(who, "exponent e2", shape.base.e2, 0.1, 1.9);
    const double largest = shape.base.semi_axes.maxCoeff();
    for (const Bump& bump : shape.bumps) {
        check_range(who, "length of a bump's direction", bump.direction.norm(), 1e-9, 1e9);
        check_range(who, "height of a bump [m]", bump.height_m, -0.5 * largest, 2 * largest);
        check_range(who, "width of a bump [rad]", bump.width_rad, 0.02, 3);
    }
}

bool finite_and_below(const Eigen::Vector3d& v, double most) {
    return v.cwiseAbs().maxCoeff() <= most && std::isfinite(v.sum());
}

// Says so only of bodies whose numbers are far from any bound; most are, and this takes a fraction of the time.
bool is_surely_whole(const MovingBody& body) {
    const WorldBodyState& s = body.state;
    const double norm = s.orientation.squaredNorm();
    const double most_turn = kFastest / 10 * body.kind->mass.inertia.minCoeff();
    return !body.pushed && s.position.squaredNorm() < kFurthest * kFurthest && norm > 0.9 && norm < 1.1 &&
           s.velocity.squaredNorm() < kFastest * kFastest &&
           s.angular_momentum.squaredNorm() < most_turn * most_turn &&
           (body.kind->modes == 0 || (s.q.cwiseAbs().dot(body.kind->gradient_bound) <= 1e6 &&
                                      s.q_dot.cwiseAbs().dot(body.kind->shape_bound) <= kFastest));
}

}  // namespace

void check_world_body(const WorldBody& body) {
    const std::string who = "body '" + body.name + "'";
    check_shape(who, body.shape);
    check_range(who, "Young's modulus [Pa]", body.material.young_pa, 1, 1e13);
    check_range(who, "Poisson's ratio", body.material.poisson, -0.9, 0.495);
    check_range(who, "density [kg/m^3]", body.material.density_kg_m3, 1e-3, 1e8);
    check_range(who, "damping alpha [1/s]", body.damping_alpha, 0, 1e6);
    check_range(who, "damping beta [s]", body.damping_beta, 0, 1e3);
    check_range(who, "damping ratio", body.damping_ratio, 0, 100);
    if (body.fidelity.fidelity == Fidelity::modal) check_range(who, "modes", body.fidelity.modes, 1, 120);
    check_range(who, "elements a side", body.fidelity.elements, 1, 4);
    check_range(who, "error", body.fidelity.error, 1e-9, 1);
    check_range(who, "impact speed [m/s]", body.fidelity.impact_mps, 0, kFastest);
    check_range(who, "triangles", body.triangles, 48, 20000);
    check_range(who, "friction", body.friction, 0, 100);
    check_range(who, "restitution", body.restitution, 0, 1);
    check_range(who, "gravity scale", body.gravity_scale, -1e3, 1e3);
    check_vector(who, "position [m]", body.world_from_body.translation(), kFurthest);
    check_vector(who, "velocity [m/s]", body.velocity, kFastest);
    check_vector(who, "angular velocity [rad/s]", body.angular_velocity, kFastest);
    double last = -1;
    for (const MotionKey& key : body.motion) {
        check_range(who, "time of a motion's key [s]", key.time_s, 0, kLongest);
        if (!(key.time_s > last)) refuse(who, "time of a motion's key [s]", key.time_s, "ascending times");
        last = key.time_s;
        check_vector(who, "position of a motion's key [m]", key.position, kFurthest);
        check_range(who, "length of a motion's quaternion", key.orientation.norm(), 1 - 1e-6, 1 + 1e-6);
    }
    const Eigen::Matrix3d r = body.world_from_body.linear();
    const double skew = (r * r.transpose() - Eigen::Matrix3d::Identity()).norm();
    if (!(skew < 1e-6) || r.determinant() < 0)
        refuse(who, "orientation: departure from a rotation", skew, "0");
}

void check_constraint(const PointConstraint& constraint, int bodies) {
    const std::string who = "constraint '" + constraint.name + "'";
    check_range(who, "first body", constraint.body_a, 0, bodies - 1);
    check_range(who, "second body", constraint.body_b, -1, bodies - 1);
    if (constraint.body_a == constraint.body_b)
        refuse(who, "second body", constraint.body_b, "another body than the first");
    check_vector(who, "first point [m]", constraint.point_a, kFurthest);
    check_vector(who, "second point [m]", constraint.point_b, kFurthest);
    if (constraint.stiffness != std::numeric_limits<double>::infinity())
        check_range(who, "stiffness [N/m]", constraint.stiffness, 1e-9, 1e15);
    check_range(who, "damping ratio", constraint.damping_ratio, 0, 1e3);
    for (const Eigen::Quaterniond& frame : {constraint.frame_a, constraint.frame_b})
        check_range(who, "length of a joint frame's quaternion", frame.norm(), 1 - 1e-6, 1 + 1e-6);
    if (!(constraint.breaking_force > 0))
        refuse(who, "breaking force [N]", constraint.breaking_force, "a number above 0");
}

void check_world(const WorldDefinition& definition) {
    const WorldSettings& s = definition.settings;
    check_range("settings", "dt [s]", s.dt, 1e-6, 0.25);
    check_range("settings", "substeps", s.substeps, 1, 1000);
    check_vector("settings", "gravity [m/s^2]", s.gravity, 1e4);
    check_range("settings", "sleep speed [m/s]", s.sleep_speed, 0, 1e3);
    for (const WorldPlane& plane : definition.planes) {
        check_range("plane", "length of the normal", plane.normal.norm(), 1 - 1e-6, 1 + 1e-6);
        check_range("plane", "offset [m]", plane.offset, -kFurthest, kFurthest);
        check_range("plane", "friction", plane.friction, 0, 100);
        check_range("plane", "restitution", plane.restitution, 0, 1);
    }
    for (const TimedForce& force : definition.forces) {
        check_range("force", "body", force.body, 0, std::numeric_limits<int>::max());
        check_vector("force", "point [m]", force.point, kFurthest);
        check_vector("force", "force [N], or impulse [N s]", force.force, kLargestForce);
        check_range("force", "time at which it begins [s]", force.from_s, 0, kLongest);
        check_range("force", "time at which it ends [s]", force.until_s, force.from_s, kLongest);
    }
}

void check_state(const WorldBodyState& state, int modes, bool fixed) {
    if (fixed && !(state.position.allFinite() && state.orientation.coeffs().allFinite()))
        refuse("state", "place of a fixed body", state.position.sum(), "finite numbers");
    if (state.q.size() != modes || state.q_dot.size() != modes)
        refuse("state", "modal coordinates", static_cast<double>(state.q.size()),
               std::to_string(modes) + ", as the body has modes");
}

std::string what_is_broken(const MovingBody& body) {
    if (is_surely_whole(body)) return {};
    const WorldBodyState& s = body.state;
    if (!finite_and_below(s.position, kFurthest)) return "position";
    const double norm = s.orientation.squaredNorm();
    if (!(norm > 0.5 && norm < 2)) return "orientation";
    if (!finite_and_below(s.velocity, kFastest)) return "velocity";
    const Eigen::Vector3d spin =
        (s.orientation.conjugate() * s.angular_momentum).cwiseQuotient(body.kind->mass.inertia);
    if (!finite_and_below(spin, kFastest)) return "angular momentum";
    // What is not finite is not below anything.
    if (body.kind->modes > 0 && !(s.q.cwiseAbs().dot(body.kind->gradient_bound) <= 1e6))
        return "modal coordinates";
    if (body.kind->modes > 0 && !(s.q_dot.cwiseAbs().dot(body.kind->shape_bound) <= kFastest))
        return "modal rates";
    if (!body.pushed) return {};
    const bool fair =
        finite_and_below(body.force / body.kind->mass.mass, kStrongest) &&
        finite_and_below(body.torque / body.kind->mass.inertia.minCoeff(), kStrongest) &&
        body.modal_force.allFinite() &&
        (body.kind->modes == 0 || body.modal_force.cwiseAbs().dot(body.kind->shape_bound) < kStrongest);
    if (!fair) return "user force";
    return {};
}

}  // namespace sim
