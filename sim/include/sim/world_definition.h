#pragma once
#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim/geometry.h"
#include "sim/modal_body.h"
#include "sim/modes.h"

namespace sim {

/// How much of a body is computed.
enum class Fidelity {
    rigid,
    linear,    ///< six uniform strains (2.12), inverse mapping in closed form
    modal,     ///< `modes` free vibration modes, polynomial mapping
    automatic  ///< the cheapest of these that meets `error` (choose_fidelity)
};

struct FidelityRequest {  ///< how much of one body to compute
    Fidelity fidelity = Fidelity::automatic;
    int modes = 12;                                ///< modal: the lowest of the non-rigid ones
    int elements = 1;                              ///< per side of the finite-element mesh
    ModeDomain domain = ModeDomain::superquadric;  ///< matter of the mass and stiffness integrals
    double error = 0.01;    ///< automatic: displacement error allowed, share of the largest extent
    double impact_mps = 5;  ///< automatic: the fastest impact expected [m/s]
};

struct FidelityChoice {        ///< see choose_fidelity
    Fidelity fidelity;         ///< rigid, linear or modal
    int modes;                 ///< number; 0 rigid, 6 linear
    double expected_error;     ///< share of the largest extent, see choose_fidelity
    GroupCut cut = {0, 0, 0};  ///< modal: whether `modes` cuts a group of equal frequencies
};

/// Where a prescribed motion has a body at a time.
struct MotionKey {
    double time_s = 0;                                                ///< since the start
    Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< body to world, unit
};

/// One body of a world.
struct WorldBody {
    std::string name;
    GeneralizedSuperquadric shape;
    Material material;
    /// C = damping_alpha M + damping_beta K (2.1): sigma = (alpha + beta omega^2) / 2 per mode, and rigid
    /// motion decays as e^(-alpha t), as by drag. Added for the modes: damping_ratio omega.
    double damping_alpha = 0, damping_beta = 0, damping_ratio = 0.05;
    FidelityRequest fidelity;
    int triangles = 360;     ///< of the sampled surface
    double friction = 0.5;   ///< Coulomb; of a pair: sqrt(a b)
    double restitution = 0;  ///< of a pair: the larger
    bool fixed = false;      ///< never moves, does not deform
    double gravity_scale = 1;
    Eigen::Isometry3d world_from_body = Eigen::Isometry3d::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< of the centre of mass [m/s]
    Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< world axes [rad/s]
    /// If not empty: the body moves as prescribed, by nothing else, and does not deform; pose and velocities
    /// above do not count. By ascending times; from key to key at a steady velocity and turn (the shorter way),
    /// at rest before the first and after the last. Its pose is exact at every time; contacts and joints see
    /// its mean velocity over a substep.
    std::vector<MotionKey> motion = {};
    [[nodiscard]] bool moves() const noexcept { return !fixed && motion.empty(); }  ///< by forces
};

/// Half-space normal . x <= offset is solid. Static.
struct WorldPlane {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit
    double offset = 0;                                  ///< [m]
    double friction = 0.5, restitution = 0;
};

enum class Joint {
    ball,   ///< one point is held: three directions
    hinge,  ///< turns about the axis: five directions
    slider  ///< slides along the axis, and does not turn: five directions
};

/// Damped springs of rest length 0 between points of a body and places, or points of another body: the
/// thesis's energy constraint. Implicit in the step, so no stiffness is too large.
///
/// Points are held along some directions of b's frame (the world's without b) and free along the others:
///   gap = E (p_a - p_b),  E: rows are the directions, turning with b; the impulse acts at p_a
/// With x the axis, y and z square to it (frame_a and frame_b, which coincide where all gaps are zero), and L
/// the largest extent of the smaller body:
///   ball    the point                       x y z
///   hinge   the point + L/2 x               x y z,     the point - L/2 x    y z
///   slider  the point +- L/2 x              y z each,  the point + L/2 y    z
/// No row follows from the others. `stiffness` and `breaking_force` are of each point. Neither limits nor
/// motors.
struct PointConstraint {
    std::string name;
    int body_a = 0;
    Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< rest body frame of a
    int body_b = -1;                                    ///< -1: point_b is a place in the world
    Eigen::Vector3d point_b = Eigen::Vector3d::Zero();
    double stiffness = 1e4;                                           ///< [N/m]
    double damping_ratio = 1;                                         ///< against the effective mass
    double breaking_force = std::numeric_limits<double>::infinity();  ///< [N]; above it the constraint breaks
    Joint joint = Joint::ball;
    Eigen::Quaterniond frame_a = Eigen::Quaterniond::Identity();  ///< to a's rest frame; hinges and sliders
    Eigen::Quaterniond frame_b = Eigen::Quaterniond::Identity();  ///< likewise of b, or the world
    /// Whether a and b collide. Empty: unless the point lies within both, their surfaces included (rest shapes).
    std::optional<bool> collide = {};
};
constexpr int kMostHeldPoints = 3;  ///< of a constraint

/// A constant force on a body over a span of time; over none, an impulse. A force acts in each substep by the
/// share of it that it lasts, so with all of force x time; an impulse over the substep in which it falls. Both
/// act where the point is, and along the body's axes as they are, when a substep begins.
struct TimedForce {
    int body = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< rest frame of the body
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< [N]; of an impulse [N s]
    bool turns = false;              ///< `force` is given in the body's axes; else the world's
    double from_s = 0, until_s = 0;  ///< since the start; equal: an impulse
};

struct WorldSettings {                                       ///< of all bodies
    double dt = 1.0 / 60;                                    ///< [s]
    int substeps = 4;                                        ///< of each step
    Eigen::Vector3d gravity = Eigen::Vector3d(0, -9.81, 0);  ///< [m/s^2]
    bool sleeping = true;
    double sleep_speed = 0.02;  ///< [m/s], of any point of a body; half a second below it: asleep
};

struct WorldDefinition {  ///< numbers of bodies and constraints are their indices
    WorldSettings settings;
    std::vector<WorldBody> bodies;
    std::vector<WorldPlane> planes;
    std::vector<PointConstraint> constraints;
    std::vector<TimedForce> forces;  ///< also on bodies that are added later
};

/// The cheapest of rigid, linear and modal (cut at group borders) whose expected error is at most
/// request.error. Expected error of a basis: an impact at v displaces the struck point by v sqrt(m c), c =
/// sum (n . phi_k)^2 / omega_k^2 its modal compliance, largest over the surface's six poles; the error is the
/// difference of that with all 75 modes of an element (of `elements` a side if more) and with the basis's, as
/// share of the largest extent. A named fidelity is kept; its error is computed. Solves for the 75 modes
/// each time: 0.7 ms with one element a side.
[[nodiscard]] FidelityChoice choose_fidelity(const Superquadric& shape, const Material& material,
                                             const FidelityRequest& request);

}  // namespace sim
