#pragma once
#include <array>
#include <memory>

#include "learned/contact_view.h"
#include "learned/learned_path.h"
#include "trace/random_stream.h"
#include "tracking/path_model.h"

namespace tracking {

/// Layers of those sizes whose weights are as large as trained ones.
inline PathModel::Layers random_layers(const std::array<std::size_t, 4>& sizes, std::uint64_t seed) {
    RandomStream random(seed);
    PathModel::Layers layers;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        const auto rows = static_cast<Eigen::Index>(sizes[i + 1]),
                   columns = static_cast<Eigen::Index>(sizes[i]);
        const double sigma = (i == 2 ? 0.05 : 1) / std::sqrt(static_cast<double>(columns));
        layers[i].weights.resize(rows, columns);
        layers[i].bias.setZero(rows);
        for (float& weight : layers[i].weights.reshaped())
            weight = static_cast<float>(sigma * random.normal());
    }
    return layers;
}

/// A network of `hidden` units in both layers, its answers about as large as the fading velocity's.
inline PathModel model_of_random_weights(std::size_t hidden, std::uint64_t seed) {
    PathModel model;
    model.layers = random_layers({StickHistory::kInputs, hidden, hidden, kPathOutputs}, seed);
    return model;
}

/// A network of contacts.
inline PathModel::Layers model_of_random_contacts(std::size_t hidden, std::uint64_t seed) {
    return random_layers({kContactInputs, hidden, hidden, kContactOutputs}, seed);
}

/// One whose answers are all zero: the fading velocity.
inline PathModel model_of_zeros() {
    PathModel model = model_of_random_weights(4, 1);
    model.layers[2].weights.setZero();
    return model;
}

}  // namespace tracking
