#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "sim/geometry.h"
#include "sim/modal_body.h"

namespace sim {

/// Which matter the mass and stiffness integrals run over. The displacement is always that of
/// elements x elements x elements 27-node bricks (triquadratic Lagrange) that fill the body's bounding box.
enum class ModeDomain {
    box,          ///< the whole brick, 3x3x3 Gauss points per element: exact
    superquadric  ///< the superquadric's volume, by quadrature of stated accuracy
};

struct ModesRequest {
    Superquadric shape;  ///< box: only the semi-axes count
    ModeDomain domain = ModeDomain::superquadric;
    Material material;
    int elements = 1;  ///< per side, 1 to 12
    int count = 12;    ///< lowest non-rigid modes wanted, to 300; -1: as many as one element has (75)
};

/// Free vibration modes of (2.5): K phi = omega^2 M phi, phi^T M phi = 1, rigid modes left out.
///
/// Canonical: ascending; each mode is even or odd in each of x, y, z (eight independent problems), a group of
/// equal eigenvalues (to 1e-9 relative) is ordered by parity class and, within one class, spanned by the
/// projections of the nodal axes in order; the largest entry (first of equals) is positive.
struct ModalBasis {
    Eigen::Vector3d half_extents = Eigen::Vector3d::Ones();  ///< of the bricks' box [m]
    int elements = 1;                                        ///< per side
    Eigen::VectorXd omega;                                   ///< [rad/s], ascending
    /// Nodal shapes, 3 (2 elements + 1)^3 x n [kg^-1/2]; row 3 k + axis, node k = ix + m (iy + m iz), m = 2
    /// elements + 1, at x = half_extents.x (2 ix / (m - 1) - 1) and so on.
    Eigen::MatrixXd nodal;
    [[nodiscard]] int count() const noexcept { return static_cast<int>(omega.size()); }  ///< of modes
};

/// Borders of the groups of equal frequencies around `count`. below == count: no group is cut.
struct GroupCut {
    int count, below, above;
};

struct FreeVibrationModes {       ///< the solution of a ModesRequest
    ModalBasis basis;             ///< the lowest `count` non-rigid modes
    Eigen::VectorXd eigenvalues;  ///< [rad^2/s^2], all computed ones, ascending, the six rigid first
    /// Parity class of each eigenvalue: bit j is set if u_j is even along its own axis j and the other
    /// components are odd in it. 0: stretching; 1, 2, 4: bending towards x, y, z (rigid: translation); 3, 5,
    /// 6: shear xy, xz, yz (rigid: rotation); 7: twisting.
    std::vector<int> parity;
    GroupCut cut;
};

/// Throws std::invalid_argument for a request out of range (extents in a ratio over 1000, or 100 with four or
/// more elements per side), std::runtime_error if no solution is found. Dense (Eigen) up to three elements
/// per side, shift-invert Lanczos (Spectra) beyond. One element costs about 0.6 ms, 2: 2, 3: 20, 4: 60,
/// 6: 300 ms, 8: 1.3 s, 12: 11 s. For the superquadric with several elements per side, brick space outside it is
/// massless and has 1e-8 of the stiffness.
[[nodiscard]] FreeVibrationModes free_vibration_modes(const ModesRequest& request);

/// Elements per side of the mesh that discretisation_errors compares with.
[[nodiscard]] int finer_elements(int elements) noexcept;
/// Estimated relative error of each frequency by the mesh, |omega / omega_exact - 1|: Richardson's
/// extrapolation with a finer mesh (two more per side, twice as many for 3; `elements` is 10 at most),
/// eigenvalues' errors taken to fall at order 4; modes are matched by parity class and their order within it.
/// Where that would take away half of the finer eigenvalue or more (a mode that the mesh cannot show at all),
/// the finer one itself is taken for exact, so the error is at least that. NaN where the counterpart lies
/// beyond the finer mesh's 300 lowest modes. Costs the finer mesh's solution.
[[nodiscard]] Eigen::VectorXd discretisation_errors(const ModesRequest& request,
                                                    const FreeVibrationModes& modes);

/// The six uniform-strain modes (2.12) of LinearBody as a basis of one element.
[[nodiscard]] ModalBasis uniform_strain_basis(const Superquadric& shape, const Material& material);

/// Mass [kg], and moments of inertia about the principal axes x, y, z [kg m^2], of the rest superquadric.
struct RigidMass {
    double mass;
    Eigen::Vector3d inertia;
};
[[nodiscard]] RigidMass rigid_mass(const Superquadric& shape, const Material& material);  ///< rest shape

/// phi(r), 3 x n [kg^-1/2]: the displacement at r by each mode; r outside the box is taken at its border (a
/// coordinate that is no number at the lower one).
[[nodiscard]] Eigen::Matrix3Xd mode_shapes_at(const ModalBasis& basis, const Eigen::Vector3d& r);

/// u(r) [m] with du/dr of a displacement given at the nodes.
struct Displacement {
    Eigen::Vector3d value;
    Eigen::Matrix3d gradient;  ///< (i, j) = du_i / dr_j [-]; column j is zero where r_j is outside the box
};
/// nodal_displacement is basis.nodal * q. No allocation.
[[nodiscard]] Displacement displacement_at(const ModalBasis& basis,
                                           const Eigen::Ref<const Eigen::VectorXd>& nodal_displacement,
                                           const Eigen::Vector3d& r) noexcept;

/// r with r + u(r) = x by Newton (2.11) from r = x, each step halved until it brings r + u(r) nearer to x: up
/// to 6 iterations for displacement gradients under 0.3 (spectral norm). The fallback is r <- r - (r + u(r) -
/// x) / 2, at most 200 times; its best r is returned, converged or not.
struct InversePoint {
    Eigen::Vector3d r;
    Eigen::Matrix3d gradient;  ///< du/dr there
    int iterations;
    bool fallback;  ///< Newton did not reach 1e-12 of the size in 20 iterations: damped fixed point was used
};
[[nodiscard]] InversePoint inverse_displacement(const ModalBasis& basis,
                                                const Eigen::Ref<const Eigen::VectorXd>& nodal_displacement,
                                                const Eigen::Vector3d& x) noexcept;

}  // namespace sim
