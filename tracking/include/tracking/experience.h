#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "tracking/path_model.h"
#include "tracking/predictor.h"
#include "tracking/trust.h"

namespace tracking {

/// What the network of a predictor (`online`, `arbitrated`) has learned from one stick: the sums A (its lower
/// triangle) and B of OnlineLayer, and, for `arbitrated`, the network's errors beside the filter's (Trust).
struct Experience {
    Eigen::MatrixXd moments, against;  ///< n x n, n x 30
    std::optional<Trust> trust = {};

    /// Adds what was learned earlier from the same model. The trust stays: it is the newest.
    Experience& operator+=(const Experience& other) {
        moments += other.moments;
        against += other.against;
        return *this;
    }
};

/// What a predictor has learned; none if it does not learn. `stick`: the name of the stick that it follows.
[[nodiscard]] std::optional<Experience> experience_of(const Predictor& predictor,
                                                      const std::string& stick = "-");

/// The model with a last layer that is solved from the experiences of all sticks together, and with their
/// trust; without provenance. `model`: the one that all of them began with. Throws std::invalid_argument for
/// an experience of a model of another size.
[[nodiscard]] PathModel taught(const PathModel& model, std::span<const Experience> experiences);

}  // namespace tracking
