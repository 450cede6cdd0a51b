#pragma once
#include <Eigen/Geometry>

namespace sim {

/// Torque-free rotation of a rigid body over a fixed time.
///
///   R body to world;  L angular momentum, world axes, constant [kg m^2/s];  m = R^T L;  I principal moments
///   H = 1/2 sum_i m_i^2 / I_i = |m|^2 / (2 I_a) + 1/2 sum_i (1 / I_i - 1 / I_a) m_i^2
///
/// a is the axis of the middle moment, b and c the others. The first term's flow is a turn of the whole body
/// about L by |L| dt / I_a; it commutes with the rest. Each of the other two is a turn about a body axis by
/// dt (1 / I_i - 1 / I_a) m_i. They are composed b/2, c, b/2 (Strang): symplectic, of second order,
/// reversible. Each turn is exact, so |m| is kept to rounding and the energy oscillates without drift;
/// spheres and symmetric tops, where a turn vanishes, are exact altogether. Where the second and third could
/// turn by more than kMostTurn they are composed several times, for dt over kMostParts at most: up to some 100
/// radians energy is within 2e-4. About 60 ns, 20 for a sphere, 40 for each further part; no allocation; never
/// NaN for finite orientation and momentum.
class FreeRotation {
public:
    /// inertia [kg m^2], each above 0; dt [s].
    FreeRotation(const Eigen::Vector3d& inertia, double dt) noexcept;

    /// The orientation dt later, a unit quaternion.
    [[nodiscard]] Eigen::Quaterniond advance(const Eigen::Quaterniond& body_to_world,
                                             const Eigen::Vector3d& angular_momentum_world) const noexcept;

private:
    static constexpr double kMostTurn = 0.1;  // [rad]
    static constexpr double kMostParts = 1024;

    int reference_;           // a
    double most_rate_;        // square of the parts for |L| = 1
    double world_rate_;       // half angle of the turn about L for |L| = 1
    double rate_b_, rate_c_;  // half angles for m_b = 1 (of the half step) and m_c = 1; b = a + 1, c = a + 2
};

/// The same for one call.
[[nodiscard]] inline Eigen::Quaterniond rotate_freely(const Eigen::Quaterniond& body_to_world,
                                                      const Eigen::Vector3d& angular_momentum_world,
                                                      const Eigen::Vector3d& inertia, double dt) noexcept {
    return FreeRotation(inertia, dt).advance(body_to_world, angular_momentum_world);
}

}  // namespace sim
