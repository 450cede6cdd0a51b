#pragma once
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "filter/sample_clock.h"
#include "learned/network.h"
#include "learned/online_layer.h"
#include "tracking/path_model.h"
#include "tracking/predictor.h"

namespace tracking {

/// The distribution of a network's errors at a lead, as its outputs state it. A position error e (forward,
/// up, across; over speed 1 s) is whitened to
///   w_i = exp(-log_spread_i) (e_i + sum over j < i of regression_ij e_j),
/// standard normal if the network is right; each component of kLever times the shaft's error has the standard
/// deviation exp(log_shaft). Seven outputs: log_spread 0 to 2, regression 10, 20, 21, log_shaft.
struct ErrorShape {
    Eigen::Vector3d log_spread, regression;
    double log_shaft;

    [[nodiscard]] Eigen::Vector3d whitened(const Eigen::Vector3d& e) const noexcept;
    [[nodiscard]] Eigen::Matrix3d covariance() const noexcept;
};
[[nodiscard]] ErrorShape shape_of(const Eigen::Ref<const Eigen::VectorXf>& spreads,
                                  std::size_t lead) noexcept;

/// The path of one stick from a network's outputs: position and direction of the shaft at any lead.
///
/// The residuals at kPathLeads are interpolated by cubic Hermite pieces whose slopes are those of the
/// parabola through three neighbours, the newest sample being the first node. Beyond the last lead the
/// residual stays constant. The orientation is the newest one, turned by the shortest rotation that brings
/// the shaft into the predicted direction.
class LearnedPath {
public:
    LearnedPath() = default;
    LearnedPath(const PathFrame& frame, const PathMeans& means, const Eigen::Quaterniond& orientation)
        : frame_(frame), orientation_(orientation), means_(means) {}

    [[nodiscard]] PosePrediction after(double lead_s) const noexcept;
    /// Covariance of the errors, as the network states it.
    [[nodiscard]] PoseCovariance covariance(double lead_s, const PathSpreads& spreads) const noexcept;
    [[nodiscard]] const PathFrame& frame() const noexcept { return frame_; }

private:
    /// The residual at a lead, with its slope over the lead; in the axes of the frame, over the speed.
    struct Added {
        Eigen::Vector3d value, slope;
    };
    /// Residual of the position (`first` = 0) or of kLever times the direction (3).
    [[nodiscard]] Added added(double lead_s, Eigen::Index first) const noexcept;
    [[nodiscard]] PoseCovariance covariance_at(std::size_t node, const PathSpreads& spreads) const noexcept;

    PathFrame frame_;
    Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
    PathMeans means_ = PathMeans::Zero();
};

/// Predictors `learned` and `online`: a network alone. With a memory its last layer learns from the samples
/// (OnlineLayer), from examples at least kExampleS apart. After a gap the history starts anew, and what was
/// learned stays. With one sample only it predicts that sample. Allocates when it is made only.
class Learned final : public Predictor {
public:
    /// `memory_s`: of OnlineLayer; 0: learns nothing.
    Learned(const PathModel& model, const Eigen::Vector3d& shaft, double memory_s = 0);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return path_.after(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override {
        return path_.covariance(lead_s, spreads());
    }
    [[nodiscard]] bool heeds_orientation() const noexcept override { return true; }
    [[nodiscard]] const LearnedPath& path() const noexcept { return path_; }
    /// The spreads that the network states for path().
    [[nodiscard]] PathSpreads spreads() const noexcept;
    /// Clears the history of samples: the next one is treated as the first.
    void forget() noexcept;
    [[nodiscard]] const OnlineLayer* online() const noexcept { return online_ ? &*online_ : nullptr; }

private:
    static constexpr double kExampleS = 1.0 / 250;

    /// An example whose longest lead has not passed yet.
    struct Example {
        double t_s = 0, dt_s = 0;
        PathFrame frame;
        Network::Hidden hidden;
    };
    void remember(const PathFrame& frame) noexcept;
    void learn() noexcept;

    Network network_;
    SampleClock clock_;
    StickHistory history_;
    LearnedPath path_;
    Network::Hidden hidden_;  // of the newest sample
    bool answered_ = false;   // by the network
    Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
    std::optional<OnlineLayer> online_;
    std::vector<Example> examples_;  // a ring
    std::size_t first_ = 0, count_ = 0;
    double last_example_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace tracking
