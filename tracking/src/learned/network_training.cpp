#include "learned/network_training.h"

#include <cmath>

#include "learned/learned_path.h"

namespace tracking {
namespace {

void leaky(Eigen::MatrixXf& h) {
    h = h.cwiseMax(kLeak * h);
}

/// Multiplies a gradient by f' where f's value, of the same sign as its argument, is `h`.
void through_leaky(Eigen::MatrixXf& gradient, const Eigen::MatrixXf& h) {
    gradient = (h.array() > 0).select(gradient, kLeak * gradient);
}

}  // namespace

InputScaling::InputScaling(const Eigen::MatrixXf& inputs, std::initializer_list<Eigen::Index> across)
    : mean(inputs.rowwise().mean()) {
    for (std::size_t v = 0; v < StickHistory::kVectors; ++v) mean[static_cast<Eigen::Index>(3 * v + 2)] = 0;
    for (const Eigen::Index row : across) mean[row] = 0;
    deviation = (inputs.colwise() - mean).rowwise().squaredNorm() / static_cast<float>(inputs.cols());
    deviation = deviation.cwiseSqrt().array() + 1e-3F;
}

void InputScaling::apply(Eigen::MatrixXf& inputs) const {
    inputs.colwise() -= mean;
    inputs.array().colwise() /= deviation.array();
}

void InputScaling::fold_into(PathModel::Layer& layer) const {
    layer.weights = layer.weights * deviation.cwiseInverse().asDiagonal();
    layer.bias -= layer.weights * mean;
}

Layers initial_layers(std::size_t inputs, std::size_t hidden, std::size_t outputs, RandomStream& random) {
    Layers layers;
    const std::array<std::size_t, 4> sizes = {inputs, hidden, hidden, outputs};
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const double sigma =
            (i + 1 == layers.size() ? 0.1 : 1.0) * std::sqrt(2.0 / static_cast<double>(sizes[i]));
        layers[i].weights.resize(static_cast<Eigen::Index>(sizes[i + 1]),
                                 static_cast<Eigen::Index>(sizes[i]));
        for (float& weight : layers[i].weights.reshaped())
            weight = static_cast<float>(sigma * random.normal());
        layers[i].bias.setZero(static_cast<Eigen::Index>(sizes[i + 1]));
    }
    return layers;
}

void run_forward(const Layers& layers, const Eigen::MatrixXf& inputs, Activations& a) {
    a.first.noalias() = layers[0].weights * inputs;
    a.first.colwise() += layers[0].bias;
    leaky(a.first);
    a.second.noalias() = layers[1].weights * a.first;
    a.second.colwise() += layers[1].bias;
    leaky(a.second);
    a.outputs.noalias() = layers[2].weights * a.second;
    a.outputs.colwise() += layers[2].bias;
}

void run_backward(const Layers& layers, const Eigen::MatrixXf& inputs, const Activations& a,
                  const Eigen::MatrixXf& outputs_gradient, Layers& gradient) {
    gradient[2].weights.noalias() = outputs_gradient * a.second.transpose();
    gradient[2].bias = outputs_gradient.rowwise().sum();
    Eigen::MatrixXf second = layers[2].weights.transpose() * outputs_gradient;
    through_leaky(second, a.second);
    gradient[1].weights.noalias() = second * a.first.transpose();
    gradient[1].bias = second.rowwise().sum();
    Eigen::MatrixXf first = layers[1].weights.transpose() * second;
    through_leaky(first, a.first);
    gradient[0].weights.noalias() = first * inputs.transpose();
    gradient[0].bias = first.rowwise().sum();
}

Adam::Adam(const PathModel::Layer& layer, float decay) : mean_(layer), decay_(decay) {
    mean_.weights.setZero();
    mean_.bias.setZero();
    square_ = mean_;
}

void Adam::step(PathModel::Layer& layer, const PathModel::Layer& gradient, float rate) {
    constexpr float kMean = 0.9F, kSquare = 0.999F, kSmallest = 1e-8F;
    ++steps_;
    const float of_mean = 1 - std::pow(kMean, static_cast<float>(steps_));
    const float of_square = 1 - std::pow(kSquare, static_cast<float>(steps_));
    const auto move = [&](auto& value, const auto& slope, auto& mean, auto& square, float decay) {
        mean = kMean * mean + (1 - kMean) * slope;
        square = kSquare * square + (1 - kSquare) * slope.cwiseAbs2();
        value.array() -= rate * (mean.array() / of_mean / ((square.array() / of_square).sqrt() + kSmallest) +
                                 decay * value.array());
    };
    move(layer.weights, gradient.weights, mean_.weights, square_.weights, decay_);
    move(layer.bias, gradient.bias, mean_.bias, square_.bias, 0);
}

}  // namespace tracking
