#pragma once
#include "modes/linear_body.h"
#include "modes/oscillator.h"
#include "shape/closest_point.h"
#include "sim/simulation.h"

namespace sim {

/// The state in the eigenbasis, in which every coordinate is an oscillator of its own: six modes, then the
/// hinge.
using OscillatorVector = Eigen::Matrix<double, 7, 1>;
struct OscillatorState {
    OscillatorVector z = OscillatorVector::Zero();
    OscillatorVector z_dot = OscillatorVector::Zero();

    void add(const OscillatorState& other, double weight) noexcept {
        z += weight * other.z, z_dot += weight * other.z_dot;
    }
};

/// Body frame to world at one time, with its rate.
///   X = world_from_body (pivot + R(swing) (D r - pivot))
struct BodyPose {
    Deformation deformation;
    Eigen::Matrix3d deformation_rate = Eigen::Matrix3d::Zero();  ///< dD/dt [1/s]
    Eigen::Matrix3d hinge = Eigen::Matrix3d::Identity();         ///< R(swing)
    Eigen::Vector3d hinge_rate =
        Eigen::Vector3d::Zero();  ///< angular velocity [rad/s], frame of world_from_body
};

/// Upper bounds of a motion: of |Ddot r| and |(D - I) r| for r in the rest shape's box, axis by axis
/// sum_j |E_ij| a_j.
struct MotionBounds {
    Eigen::Vector3d speed =
        Eigen::Vector3d::Zero();  ///< of a material point by deformation [m/s], before the hinge
    Eigen::Vector3d reach = Eigen::Vector3d::Zero();  ///< displacement by deformation [m]
    double turn = 0;                                  ///< hinge rate [rad/s]
    double swing = 0;                                 ///< hinge angle [rad]

    void widen(const MotionBounds& other) noexcept;  ///< to hold both
};

/// Pose of a state; where the limit on strains and swing acts (see BodyModel).
[[nodiscard]] BodyPose pose_of(const Stand& stand, const ModalState& state) noexcept;

/// Everything about a body that its definition settles, computed once.
///
/// Linear and limited: the state is linear in the impulses and never cut, so responses superpose exactly.
/// What is seen and touched (body_matrix, contacts) limits each coordinate s:
///   |s| <= L/2: s;  beyond: sign(s) (L/2 + L/2 tanh(2 |s| / L - 1))
///   L = 0.4 for scales, 0.15 for shears, 1 rad for the swing
/// so each eigenvalue of D lies within 1 -+ (0.4 + 2 * 0.15), that is 0.3 to 1.7 (Gershgorin), however strong
/// or many the strikes are.
class BodyModel {
public:
    explicit BodyModel(const BodyDefinition& definition);  ///< throws std::invalid_argument, see check_body

    [[nodiscard]] const BodyDefinition& definition() const noexcept { return definition_; }  ///< as given
    [[nodiscard]] const Gauge& gauge() const noexcept { return gauge_; }                     ///< rest shape
    [[nodiscard]] const LinearBody& linear() const noexcept { return linear_; }  ///< mass and modes
    [[nodiscard]] const Eigen::Isometry3d& body_from_world() const noexcept { return body_from_world_; }
    /// Angular frequencies and decay rates of the visible modes, then of the hinge.
    [[nodiscard]] const OscillatorVector& omega() const noexcept { return omega_; }
    [[nodiscard]] const OscillatorVector& sigma() const noexcept { return sigma_; }

    [[nodiscard]] OscillatorState to_oscillators(const ModalState& state) const noexcept;
    [[nodiscard]] ModalState to_modal(const OscillatorState& state) const noexcept;  ///< modes to strains
    /// Exact free motion over dt; a negative dt counts as zero.
    [[nodiscard]] OscillatorState after(const OscillatorState& state, double dt) const noexcept;
    /// State just after `impulse` on the body at rest:
    ///   z_dot = gain Phi^T Q,  swing_dot = axis . ((r - pivot) x J) / I.
    [[nodiscard]] OscillatorState kick(const Impulse& impulse) const noexcept;
    [[nodiscard]] BodyPose pose(const OscillatorState& state) const noexcept {
        return pose_of(definition_.stand, to_modal(state));
    }
    /// Bounds of the free motion from `state` on, from its energy, which damping only lowers.
    [[nodiscard]] MotionBounds bounds(const OscillatorState& state) const noexcept;
    /// (1 + e) m_eff [kg]: the stick's mass, with the body's own where it hangs.
    [[nodiscard]] double impulse_per_speed() const noexcept { return impulse_per_speed_; }

private:
    void set_visual_modes();
    void set_hinge();
    [[nodiscard]] double reference_peak(const Eigen::Vector3d& r, int axis) const;

    BodyDefinition definition_;
    Gauge gauge_;
    LinearBody linear_;
    Eigen::Isometry3d body_from_world_;
    OscillatorVector omega_, sigma_;
    double gain_ = 0;
    double hinge_inertia_ = 0;
    double impulse_per_speed_ = 0;
};

/// First zone that holds a point of the rest surface, -1 if none.
[[nodiscard]] int zone_at(const BodyDefinition& body, const Eigen::Vector3d& rest_point) noexcept;

/// Throws std::invalid_argument naming the body, the value, what was expected.
void check_body(const BodyDefinition& definition);

}  // namespace sim
