#pragma once
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "sample_clock.h"
#include "stick_history.h"
#include "tracking/path_model.h"
#include "tracking/predictor.h"

namespace tracking {

/// The leads that a network answers [s]; between them its answers are interpolated.
inline constexpr std::array<double, 5> kPathLeads = {1.0 / 60, 1.0 / 30, 1.0 / 15, 1.0 / 10, 0.15};
inline constexpr std::size_t kNodes = kPathLeads.size();

/// A network's outputs: for each lead first what is added to the fading position, and kLever times what is
/// added to the fading direction, in the axes of the PathFrame and over speed 1 s; then for each lead the
/// numbers of an ErrorShape.
inline constexpr int kShapeNumbers = 7;
inline constexpr std::size_t kPathMeans = 6 * kNodes, kPathSpreads = kShapeNumbers * kNodes,
                             kPathOutputs = kPathMeans + kPathSpreads;
using PathOutputs = Eigen::Matrix<float, static_cast<int>(kPathOutputs), 1>;

/// What a network says of its errors at a lead: of a position error e (forward, up, across; over speed 1 s) the
/// whitened one is
///   w_i = exp(-log_spread_i) (e_i + sum over j < i of regression_ij e_j),
/// standard normal if the network is right; each component of kLever times the shaft's error has the standard
/// deviation exp(log_shaft). Seven outputs: log_spread 0 to 2, regression 10, 20, 21, log_shaft.
struct ErrorShape {
    Eigen::Vector3d log_spread, regression;
    double log_shaft;

    [[nodiscard]] Eigen::Vector3d whitened(const Eigen::Vector3d& e) const noexcept;
    [[nodiscard]] Eigen::Matrix3d covariance() const noexcept;
};
[[nodiscard]] ErrorShape shape_of(const Eigen::Ref<const Eigen::VectorXf>& outputs,
                                  std::size_t lead) noexcept;

/// The slope of f left of zero.
inline constexpr float kLeak = 0.1F;
/// A network's answer. Allocates nothing. One product after the other in a fixed order.
template <class Inputs, class Outputs>
void evaluate(const PathModel::Layers& layers, const Inputs& inputs, Outputs& outputs) noexcept {
    using Hidden = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, static_cast<int>(PathModel::kMostHidden), 1>;
    const auto& [first, second, last] = layers;
    Hidden h1 = first.bias;
    h1.noalias() += first.weights * inputs;
    h1 = h1.cwiseMax(kLeak * h1);
    Hidden h2 = second.bias;
    h2.noalias() += second.weights * h1;
    h2 = h2.cwiseMax(kLeak * h2);
    outputs = last.bias;
    outputs.noalias() += last.weights * h2;
}

/// The path of one stick as a network answers it: position and direction of the shaft at any lead.
///
/// Between the leads of the answers cubic Hermite pieces whose slopes are those of the parabola through three
/// neighbours, the newest sample being the first node; beyond the last lead what was added stays. The
/// orientation turns the newest one by the shortest way that brings the shaft into its direction.
class LearnedPath {
public:
    LearnedPath() = default;
    LearnedPath(const PathFrame& frame, const PathOutputs& outputs, const Eigen::Quaterniond& orientation);

    [[nodiscard]] PosePrediction after(double lead_s) const noexcept;
    /// Of the errors, as the network states it.
    [[nodiscard]] PoseCovariance covariance(double lead_s) const noexcept;
    [[nodiscard]] const PathFrame& frame() const noexcept { return frame_; }

private:
    /// Added to position and direction, with the slope over the lead.
    struct Node {
        Eigen::Matrix<double, 6, 1> value = Eigen::Matrix<double, 6, 1>::Zero(),
                                    slope = Eigen::Matrix<double, 6, 1>::Zero();
    };
    [[nodiscard]] Node added(double lead_s) const noexcept;
    void set_slopes() noexcept;
    [[nodiscard]] PoseCovariance covariance_at(std::size_t node) const noexcept;

    PathFrame frame_;
    Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
    PathOutputs outputs_ = PathOutputs::Zero();
    std::array<Node, kNodes + 1> nodes_;  // the first at lead 0
};

/// Predictor `learned`: a network alone. Starts anew after a gap; with one sample only it holds.
class Learned final : public Predictor {
public:
    Learned(std::shared_ptr<const PathModel> model, const Eigen::Vector3d& shaft)
        : model_(std::move(model)), history_(shaft) {}

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override {
        return path_.after(lead_s);
    }
    [[nodiscard]] double time_s() const noexcept override { return clock_.time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override {
        return path_.covariance(lead_s);
    }
    [[nodiscard]] bool heeds_orientation() const noexcept override { return true; }
    [[nodiscard]] const LearnedPath& path() const noexcept { return path_; }
    /// The next sample begins a motion that the ones before say nothing of.
    void forget() noexcept { history_.restart(); }

private:
    std::shared_ptr<const PathModel> model_;
    SampleClock clock_;
    StickHistory history_;
    LearnedPath path_;
    Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
};

}  // namespace tracking
