#pragma once
#include <array>
#include <vector>

#include "kalman_predictor.h"

namespace tracking {

/// How a bank's models are compared when a new measurement y arrives at t: with what each had predicted for t
/// one lead ago (3.28), at the sample nearest to t - lead.
enum class BankScore {
    distance,    ///< the nearest prediction wins
    likelihood,  ///< (3.27) with R the innovation's own covariance, F P F^T + Q + R, and its determinant
};

/// Three Kalman filters with different models of motion in parallel (Friedmann 1992, 3.25-3.28). predict()
/// speaks for the model that scored best at the newest sample; until predictions a lead old exist, for the
/// first. Each model's own prediction stays available, so that alternative responses can be kept ready. No
/// allocation after construction.
class ModelBank final : public Predictor {
public:
    static constexpr std::size_t kModels = 3;
    static constexpr std::size_t kHistory = 256;  ///< samples within a lead at most

    struct Options {
        std::array<MotionModel, kModels> models;
        double lead_s = 1.0 / 15;
        BankScore score = BankScore::distance;
        double gate_sigmas = 0;
    };

    explicit ModelBank(const Options& options);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return predict_model(selected_, lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    [[nodiscard]] std::size_t models() const noexcept override { return kModels; }
    [[nodiscard]] std::size_t selected() const noexcept override { return selected_; }
    [[nodiscard]] PosePrediction predict_model(std::size_t index, double lead_s) const noexcept override;

private:
    using States = std::array<AxisStates, kModels>;
    using Covariances = std::array<AxisMatrix<double>, kModels>;

    SampleStatus start(const PoseSample& sample) noexcept;
    SampleStatus update(const PoseSample& sample) noexcept;
    void remember() noexcept;
    /// Turns the orientations on and takes the measured one; false if a state is no longer finite.
    [[nodiscard]] bool update_rotations(const PoseSample& sample, double dt) noexcept;
    void select(const PoseSample& sample) noexcept;
    [[nodiscard]] double penalty(std::size_t model, std::size_t past, double elapsed,
                                 const Lanes& measured) const noexcept;
    /// Where the history holds the sample `age` samples before the newest.
    [[nodiscard]] std::size_t place(std::size_t age) const noexcept {
        return (newest_ + kHistory - age) % kHistory;
    }

    SampleClock clock_;
    OutlierGate gate_;
    std::array<PositionFilter, kModels> position_;
    std::array<RotationFilter, kModels> rotation_;
    double lead_s_;
    BankScore score_;
    std::size_t selected_ = 0;
    // Of past samples; kHistory long from the start.
    std::vector<double> times_s_;
    std::vector<States> states_;
    std::vector<Covariances> covariances_;  // where the score needs them
    std::size_t newest_ = 0, held_ = 0;
    std::size_t age_ = 0;  // of the entry that the last sample was scored with
};

}  // namespace tracking
