#pragma once
#include <array>
#include <vector>

#include "filter/kalman_predictor.h"

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
    /// Covariance of the mixture of the models about the selected prediction: sum_i w_i (P_i + d_i d_i^T),
    /// with the probability w_i of model i by its innovations of the last kEvidence samples, and d_i from the
    /// selected prediction to that of model i.
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    /// That of the selected model.
    [[nodiscard]] std::optional<Motion> motion() const noexcept override {
        return motion_of_model(selected_);
    }
    [[nodiscard]] std::optional<Motion> motion_of_model(std::size_t index) const noexcept override {
        return rotation_[index].motion(position_[index].now().x);
    }
    [[nodiscard]] std::size_t models() const noexcept override { return kModels; }
    [[nodiscard]] std::size_t selected() const noexcept override { return selected_; }
    [[nodiscard]] PosePrediction predict_model(std::size_t index, double lead_s) const noexcept override;
    [[nodiscard]] const PositionFilter& position(std::size_t index) const noexcept {
        return position_[index];
    }

private:
    using PerModel = std::array<double, kModels>;
    static constexpr std::size_t kEvidence = 32;

    struct Past {
        double t_s = 0;
        std::array<AxisStates, kModels> x;
        std::array<AxisMatrix<double>, kModels> p{};
        PerModel innovation_square{},
            innovation_variance{1, 1, 1};  ///< 0 and 1 at a start: no evidence for any model
    };

    SampleStatus start(const PoseSample& sample) noexcept;
    SampleStatus update(const PoseSample& sample) noexcept;
    void remember(const PerModel& innovation_square, const PerModel& innovation_variance) noexcept;
    /// Probabilities of the models from their innovations of the last kEvidence samples.
    [[nodiscard]] PerModel probabilities() const noexcept;
    void select(const PoseSample& sample) noexcept;
    [[nodiscard]] double penalty(std::size_t model, const Past& past, double elapsed,
                                 const Lanes& measured) const noexcept;
    [[nodiscard]] const Past& past(std::size_t age) const noexcept {
        return history_[(newest_ + kHistory - age) % kHistory];
    }

    SampleClock clock_;
    OutlierGate gate_;
    std::array<PositionFilter, kModels> position_;
    std::array<RotationFilter, kModels> rotation_;
    double lead_s_;
    BankScore score_;
    std::size_t selected_ = 0;
    std::vector<Past> history_;  // kHistory long from the start
    std::size_t newest_ = 0, held_ = 0;
    std::size_t age_ = 0;  // of the entry that the last sample was scored with
};

}  // namespace tracking
