#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <initializer_list>

#include "trace/random_stream.h"
#include "tracking/path_model.h"

namespace tracking {

/// Values of every layer for a batch: columns are examples.
struct Activations {
    Eigen::MatrixXf first, second, outputs;  ///< of the hidden units after f; of the output units
};

using Layers = std::array<PathModel::Layer, 3>;

/// Weights as He et al. (2015) start them, a tenth of that in the last layer; no biases.
[[nodiscard]] Layers initial_layers(std::size_t inputs, std::size_t hidden, std::size_t outputs,
                                    RandomStream& random);
void run_forward(const Layers& layers, const Eigen::MatrixXf& inputs, Activations& activations);
/// Backpropagation: from the gradient of a loss by the outputs to that by weights and biases, `gradient`.
void run_backward(const Layers& layers, const Eigen::MatrixXf& inputs, const Activations& activations,
                  const Eigen::MatrixXf& outputs_gradient, Layers& gradient);

/// Standardises inputs for training: (x - mean) / deviation. Components across the motion (the third of each
/// vector of a StickHistory, with which inputs begin, and the inputs `across`) get a mean of 0, so that
/// mirroring changes their sign.
struct InputScaling {
    Eigen::VectorXf mean, deviation;

    /// Columns are examples.
    explicit InputScaling(const Eigen::MatrixXf& inputs, std::initializer_list<Eigen::Index> across = {});
    void apply(Eigen::MatrixXf& inputs) const;
    /// Changes the first layer so that it takes inputs as they are.
    void fold_into(PathModel::Layer& layer) const;
};

/// Adam (Kingma and Ba 2015, algorithm 1) with decoupled weight decay (Loshchilov and Hutter 2019, algorithm
/// 2; biases do not decay), of one layer.
class Adam {
public:
    Adam(const PathModel::Layer& layer, float decay);
    void step(PathModel::Layer& layer, const PathModel::Layer& gradient, float rate);

private:
    PathModel::Layer mean_, square_;
    float decay_;
    int steps_ = 0;
};

}  // namespace tracking
