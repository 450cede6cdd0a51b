#pragma once
#include <Eigen/Core>

#include "learned/stick_history.h"
#include "tracking/path_model.h"

namespace tracking {

/// The leads that a network answers [s]; between them its answers are interpolated.
inline constexpr std::array<double, 5> kPathLeads = {1.0 / 60, 1.0 / 30, 1.0 / 15, 1.0 / 10, 0.15};
inline constexpr std::size_t kNodes = kPathLeads.size();

/// A network's outputs. First the means, for each lead: the residual of the fading position, and kLever times
/// that of the fading direction, in the axes of the PathFrame and over speed 1 s. Then the spreads, for each
/// lead: the numbers of an ErrorShape.
inline constexpr int kShapeNumbers = 7;
inline constexpr std::size_t kPathMeans = 6 * kNodes, kPathSpreads = kShapeNumbers * kNodes,
                             kPathOutputs = kPathMeans + kPathSpreads;
using PathMeans = Eigen::Matrix<float, static_cast<int>(kPathMeans), 1>;
using PathSpreads = Eigen::Matrix<float, static_cast<int>(kPathSpreads), 1>;

/// The slope of f left of zero.
inline constexpr float kLeak = 0.1F;

/// A path model laid out to be run: rows are padded to whole packets of the processor, so that a product
/// keeps its sums in registers. Sums run over the columns in order: the same bits on one kind of processor.
/// Allocates when it is made only.
class Network {
public:
    /// Values of the second hidden layer, zero beyond the layer's units.
    using Hidden =
        Eigen::Matrix<float, Eigen::Dynamic, 1, 0, static_cast<int>(PathModel::kMostHidden) + 16, 1>;

    explicit Network(const PathModel& model);

    /// Where the shaft's direction is not known its inputs are zero, and their columns are skipped.
    void find_hidden(const StickHistory::Inputs& inputs, Hidden& hidden) const noexcept;
    [[nodiscard]] PathMeans means(const Hidden& hidden) const noexcept;
    [[nodiscard]] PathSpreads spreads(const Hidden& hidden) const noexcept;

    [[nodiscard]] Eigen::Index units() const noexcept { return units_; }
    /// The last layer's rows of the means: kPathMeans x units, and their biases.
    [[nodiscard]] Eigen::MatrixXf mean_weights() const {
        return means_.weights.topLeftCorner(kPathMeans, units_);
    }
    [[nodiscard]] Eigen::VectorXf mean_bias() const { return means_.bias.head(kPathMeans); }
    void set_means(const Eigen::Ref<const Eigen::MatrixXf>& weights,
                   const Eigen::Ref<const Eigen::VectorXf>& bias) noexcept;

private:
    PathModel::Layer first_, second_, means_, spreads_;
    Eigen::Index units_;
};

}  // namespace tracking
