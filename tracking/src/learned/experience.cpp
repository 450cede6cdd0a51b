#include "tracking/experience.h"

#include <algorithm>
#include <stdexcept>

#include "learned/arbitrated.h"
#include "learned/learned_path.h"

namespace tracking {

std::optional<Experience> experience_of(const Predictor& predictor, const std::string& stick) {
    const auto* learned = dynamic_cast<const Learned*>(&predictor);
    const auto* arbitrated = dynamic_cast<const Arbitrated*>(&predictor);
    if (arbitrated != nullptr) learned = &arbitrated->learned();
    if (learned == nullptr || learned->online() == nullptr) return std::nullopt;
    Experience experience = learned->online()->experience();
    if (arbitrated == nullptr) return experience;
    experience.trust = arbitrated->trust();
    experience.trust->stick = stick;
    return experience;
}

void begin_with_trust(Predictor& predictor, const PathModel& model, std::string_view stick) {
    auto* arbitrated = dynamic_cast<Arbitrated*>(&predictor);
    const auto trust = std::ranges::find(model.trust, stick, &Trust::stick);
    if (arbitrated != nullptr && trust != model.trust.end()) arbitrated->begin_with(*trust);
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
    for (const Experience& experience : experiences)
        if (experience.trust) result.trust.push_back(*experience.trust);
    result.layers = model.layers;
    result.contacts = model.contacts;
    result.layers[2].weights.topRows<kPathMeans>() = layer.weights().leftCols(network.units());
    result.layers[2].bias.head<kPathMeans>() = layer.weights().rightCols<1>();
    return result;
}

}  // namespace tracking
