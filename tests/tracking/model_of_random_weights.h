#pragma once
#include <memory>

#include "learned_path.h"
#include "random_stream.h"
#include "tracking/path_model.h"

namespace tracking {

/// A network of `hidden` units in both layers whose weights are as large as trained ones, its answers about as
/// large as the fading velocity's.
inline PathModel model_of_random_weights(std::size_t hidden, std::uint64_t seed) {
    RandomStream random(seed);
    PathModel model;
    const std::array<std::size_t, 4> sizes = {StickHistory::kInputs, hidden, hidden, kPathOutputs};
    for (std::size_t i = 0; i < model.layers.size(); ++i) {
        const auto rows = static_cast<Eigen::Index>(sizes[i + 1]),
                   columns = static_cast<Eigen::Index>(sizes[i]);
        const double sigma = (i == 2 ? 0.05 : 1) / std::sqrt(static_cast<double>(columns));
        model.layers[i].weights.resize(rows, columns);
        model.layers[i].bias.setZero(rows);
        for (float& weight : model.layers[i].weights.reshaped())
            weight = static_cast<float>(sigma * random.normal());
    }
    return model;
}

/// One whose answers are all zero: the fading velocity.
inline PathModel model_of_zeros() {
    PathModel model = model_of_random_weights(4, 1);
    model.layers[2].weights.setZero();
    return model;
}

}  // namespace tracking
