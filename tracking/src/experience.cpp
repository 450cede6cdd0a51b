#include "tracking/experience.h"

#include <stdexcept>

#include "arbitrated.h"
#include "learned_path.h"

namespace tracking {

std::optional<Experience> experience_of(const Predictor& predictor) {
    const auto* learned = dynamic_cast<const Learned*>(&predictor);
    if (const auto* arbitrated = dynamic_cast<const Arbitrated*>(&predictor))
        learned = &arbitrated->learned();
    if (learned == nullptr || learned->online() == nullptr) return std::nullopt;
    return learned->online()->experience();
}

PathModel taught(const PathModel& model, std::span<const Experience> experiences) {
    const Network network(model);
    OnlineLayer layer(network, 1);
    for (const Experience& experience : experiences) {
        if (experience.moments.rows() != network.units() + 1 ||
            experience.moments.cols() != network.units() + 1 ||
            experience.against.rows() != network.units() + 1 ||
            experience.against.cols() != Eigen::Index{kPathMeans})
            throw std::invalid_argument(
                "found what was learned with another model, expected one of its size");
        layer.add(experience);
    }
    layer.solve();
    PathModel result;
    result.layers = model.layers;
    result.contacts = model.contacts;
    result.layers[2].weights.topRows<kPathMeans>() = layer.weights().leftCols(network.units());
    result.layers[2].bias.head<kPathMeans>() = layer.weights().rightCols<1>();
    return result;
}

}  // namespace tracking
