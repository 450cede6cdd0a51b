#include <algorithm>
#include <cmath>

#include "sim/world.h"

namespace sim {
namespace {

constexpr int kReferenceModes = 75;

/// Displacement [m] of each pole (x, y, z: opposite poles are alike) struck along its normal.
class PoleDisplacements {
public:
    PoleDisplacements(const ModalBasis& basis, double mass, double speed) : scale_(speed * std::sqrt(mass)) {
        compliance_.setZero(3, basis.count() + 1);
        for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d pole = basis.half_extents[axis] * Eigen::Vector3d::Unit(axis);
            const Eigen::RowVectorXd normal = mode_shapes_at(basis, pole).row(axis);
            for (int k = 0; k < basis.count(); ++k)
                compliance_(axis, k + 1) =
                    compliance_(axis, k) + normal[k] * normal[k] / (basis.omega[k] * basis.omega[k]);
        }
    }
    /// By the lowest `modes`.
    [[nodiscard]] Eigen::Array3d of(int modes) const {
        return scale_ * compliance_.col(modes).array().sqrt();
    }
    [[nodiscard]] int modes() const { return static_cast<int>(compliance_.cols()) - 1; }

private:
    double scale_;
    Eigen::Matrix3Xd compliance_;  // cumulative [m/N]
};

class FidelityErrors {
public:
    FidelityErrors(const Superquadric& shape, const Material& material, const FidelityRequest& request)
        : FidelityErrors(
              shape, material, request,
              free_vibration_modes({shape, request.domain, material, request.elements, kReferenceModes})
                  .basis) {}

    [[nodiscard]] double rigid() const { return share(Eigen::Array3d::Zero()); }
    [[nodiscard]] double linear() const { return share(linear_.of(linear_.modes())); }
    [[nodiscard]] double modal(int modes) const { return share(reference_.of(modes)); }
    /// The smallest whole groups of modes that are good enough; all if none is.
    [[nodiscard]] int modes_within(double error) const {
        for (int modes = 1; modes < reference_.modes(); ++modes)
            if (is_border(modes) && modal(modes) <= error) return modes;
        return reference_.modes();
    }

private:
    FidelityErrors(const Superquadric& shape, const Material& material, const FidelityRequest& request,
                   const ModalBasis& all)
        : extent_(2 * shape.semi_axes.maxCoeff()),
          omega_(all.omega),
          reference_(all, sim::rigid_mass(shape, material).mass, request.impact_mps),
          linear_(uniform_strain_basis(shape, material), sim::rigid_mass(shape, material).mass,
                  request.impact_mps) {}

    [[nodiscard]] double share(const Eigen::Array3d& displacement) const {
        return (reference_.of(reference_.modes()) - displacement).abs().maxCoeff() / extent_;
    }
    [[nodiscard]] bool is_border(int modes) const { return omega_[modes] > omega_[modes - 1] * (1 + 1e-9); }

    double extent_;
    Eigen::VectorXd omega_;
    PoleDisplacements reference_, linear_;
};

}  // namespace

FidelityChoice choose_fidelity(const Superquadric& shape, const Material& material,
                               const FidelityRequest& request) {
    const FidelityErrors errors(shape, material, request);
    const bool automatic = request.fidelity == Fidelity::automatic;
    if (request.fidelity == Fidelity::rigid || (automatic && errors.rigid() <= request.error))
        return {Fidelity::rigid, 0, errors.rigid()};
    if (request.fidelity == Fidelity::linear || (automatic && errors.linear() <= request.error))
        return {Fidelity::linear, 6, errors.linear()};
    const int modes =
        automatic ? errors.modes_within(request.error) : std::clamp(request.modes, 1, kReferenceModes);
    return {Fidelity::modal, modes, errors.modal(modes)};
}

}  // namespace sim
