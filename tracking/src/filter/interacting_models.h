#pragma once
#include <array>

#include "filter/kalman_predictor.h"

namespace tracking {

/// Interacting multiple models (Blom and Bar-Shalom 1988): three Singer models with the same decay and
/// different densities, between which the motion switches as a Markov process.
///
///   mu_j  probability of mode j; pi_jj = exp(-rate dt), the rest shared equally by the other modes
///   mix   w_ij = pi_ij mu_i / c_j, c_j = sum_i pi_ij mu_i; x_0j = sum_i w_ij x_i,
///         P_0j = sum_i w_ij (P_i + (x_i - x_0j)(x_i - x_0j)^T)
///   then  each mode propagates and corrects its mixed state; mu_j ~ c_j times the likelihood of its
///         innovation, joint over the axes,
///         not below kLeastProbability
///   out   x = sum_j mu_j x_j, and the covariance of that mixture
///
/// The spread of the modes differs between the axes, so each axis has its own covariance, in lanes. The
/// rotation is one filter with the middle density. No allocation.
class InteractingModels final : public Predictor {
public:
    static constexpr std::size_t kModes = 3;
    static constexpr double kLeastProbability = 1e-6;

    struct Options {
        double alpha;                        ///< [1/s]
        std::array<double, kModes> density;  ///< [m^2/s^5]
        double switching_rate;               ///< out of each mode, in all [1/s]
        double measurement_variance;         ///< [m^2]
        Eigen::Vector3d initial_variance;
        double gate_sigmas = 0;
    };

    explicit InteractingModels(const Options& options);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    /// Covariance of the mixture, propagated over the lead; the modes go on switching in steps like the
    /// newest.
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    [[nodiscard]] std::optional<Motion> motion() const noexcept override { return rotation_.motion(mean_); }

    using Probabilities = std::array<double, kModes>;
    [[nodiscard]] const Probabilities& probabilities() const noexcept { return modes_.mu; }

    struct Mode {
        AxisStates x;
        AxisMatrix<Lanes> p;
    };
    [[nodiscard]] const Mode& mode(std::size_t j) const noexcept { return modes_.mode[j]; }

private:
    struct Modes {
        std::array<Mode, kModes> mode;
        Probabilities mu{};
    };

    SampleStatus start(const PoseSample& sample) noexcept;
    SampleStatus update(const PoseSample& sample) noexcept;
    [[nodiscard]] Modes mixed(double dt) const noexcept;
    /// The modes' probabilities after a step dt of the Markov chain.
    [[nodiscard]] Probabilities switched(const Probabilities& mu, double dt) const noexcept;
    /// Covariance of the mixture now.
    [[nodiscard]] AxisMatrix<Lanes> mixture() const noexcept;
    void correct_modes(Modes& modes, const Eigen::Vector3d& measured) const noexcept;
    [[nodiscard]] static AxisStates mean_of(const Modes& modes) noexcept;

    SampleClock clock_;
    OutlierGate gate_;
    RotationFilter rotation_;
    Options options_;
    MotionModel unit_;  ///< the Singer model of density 1
    Modes modes_;
    AxisStates mean_;
    double period_ = 0;  ///< the newest step, 0 until there was one [s]
};

}  // namespace tracking
