#pragma once
#include <array>
#include <vector>

#include "modes/oscillator.h"
#include "shape/generalized_surface.h"
#include "shape/lanes.h"
#include "sim/surface_mesh.h"
#include "sim/world_definition.h"

namespace sim {

/// Exact step of one mode under a modal force held over tau, in terms of the held impulse P = f tau:
///   mean rate  (z1 - z0) / tau = mean_z z0 + mean_rate z0' + compliance P
///   end rate   z1'             = c z0 + d z0' + rate P
/// compliance = (1 - a) / (omega tau)^2 is at least 0 for every omega tau and damping, 1/2 for soft modes,
/// and 1 / (omega tau)^2 for stiff ones, which then yield statically.
struct HeldStep {
    double mean_z, mean_rate, compliance, c, d, rate;
    double root_compliance;
};
[[nodiscard]] HeldStep held_step(double omega, double sigma, double tau) noexcept;  ///< tau [s] > 0

/// The same for all modes of a body, entry k of each for mode k.
struct HeldSteps {
    Eigen::ArrayXd mean_z, mean_rate, compliance, c, d, rate, root_compliance;
    HeldSteps() = default;
    HeldSteps(const Eigen::VectorXd& omega, const Eigen::VectorXd& sigma, double tau);
};

constexpr int kProbes = 56;         // 53 in whole lanes, the rest copies
constexpr int kSubstepLevels = 10;  // a substep may be halved so often, less one
constexpr int kMostModes = 128;     // of a body, whole lanes (world_check: 120)

/// What bodies of one shape, material, fidelity and sampling share; computed once.
struct BodyKind {
    WorldBody definition;  ///< of the first such body; pose and velocities are not used
    FidelityChoice choice;
    GeneralizedSurface surface;
    RigidMass mass;
    ModalBasis basis;
    Eigen::VectorXd sigma;           ///< decay rates [1/s]
    Eigen::VectorXd gradient_bound;  ///< largest |d phi_k / dr| (Frobenius) over the probes
    HeldSteps whole;                 ///< for a step
    Eigen::Vector3d half_box;        ///< of the rest surface, bumps included [m]
    double step_drag = 1;            ///< e^(-alpha dt): what damping_alpha leaves of rigid motion
    double root_mass = 0;            ///< sqrt(m)
    Eigen::Vector3d root_inertia = Eigen::Vector3d::Zero();  ///< sqrt(I)
    Eigen::VectorXd shape_bound = {};                        ///< largest |phi_k| over the samples [kg^-1/2]
    int modes = 0, width = 8;      ///< width: floats of a Jacobian's row, 8 + mode_width
    int mode_width = 0;            ///< modes, whole lanes
    bool ellipsoid = false;        ///< e1 = e2 = 1 without bumps: gauge in closed form
    int samples = 0, batches = 0;  ///< batches of eight samples
    LaneArray rest = {};           ///< samples, neighbours together: [axis][8 batches]
    LaneArray batch_balls = {};    ///< that hold a batch at rest: [x, y, z, radius][whole_lanes(batches)]
    Eigen::Vector3f sample_box = Eigen::Vector3f::Zero();  ///< half extents of the samples at rest [m]
    float sample_radius = 0;                               ///< [m]
    LaneArray shapes = {};                                 ///< phi at samples: [mode][axis][8 batches]
    LaneArray sample_shapes = {};                          ///< phi at samples: [sample][axis][mode_width]
    /// What depends on the length of a substep; entry n: 1/2^n of the shortest that is usual.
    struct Substep {
        HeldSteps held = {};
        double drag = 1;                 ///< as step_drag
        LaneArray root_compliance = {};  ///< [mode_width]
    };
    std::array<Substep, kSubstepLevels> substeps = {};
    /// d phi / dr at 53 points of the body, the probes: centre, and the surface in 26 directions and half-way
    /// to it: [mode][3 i + j][kProbes].
    LaneArray gradients = {};
    LaneArray polynomials = {};       ///< phi's coefficients: [brick][27][axis][mode_width]
    LaneArray mode_polynomials = {};  ///< the same: [mode][whole_lanes(bricks^3 x 81)]
    int bricks = 1;                   ///< a side

    [[nodiscard]] bool linear() const noexcept { return choice.fidelity == Fidelity::linear; }
    /// phi at a rest point, [axis][mode_width] floats.
    void shapes_at(const Eigen::Vector3f& r, float* out) const noexcept;
    /// Brick that holds r, with r in its coordinates.
    struct Local {
        int brick;
        Eigen::Vector3f xi;
    };
    [[nodiscard]] Local locate(const Eigen::Vector3f& r) const noexcept;  ///< r in the rest shape [m]
};

/// Throws std::invalid_argument naming the body, what was found and expected.
[[nodiscard]] BodyKind make_body_kind(const WorldBody& body, const WorldSettings& settings);
/// Whether two bodies can share a kind.
[[nodiscard]] bool same_kind(const WorldBody& a, const WorldBody& b) noexcept;

}  // namespace sim
