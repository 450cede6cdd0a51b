#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "tracking/path_model.h"
#include "tracking/predictor.h"
#include "tracking/trust.h"

namespace tracking {

/// What a stick has taught the network of a predictor (`online`, `arbitrated`): the sums A (its lower triangle) and B of
/// OnlineLayer, and the trust that the network has earned where it is weighed (`arbitrated`).
struct Experience {
    Eigen::MatrixXd moments, against;  ///< n x n, n x 30
    std::optional<Trust> trust = {};

    /// And what was learned before from the same model; trust is that of the end.
    Experience& operator+=(const Experience& other) {
        moments += other.moments;
        against += other.against;
        return *this;
    }
};

/// None of a predictor that does not learn. `stick`: the name of the stick that it follows.
[[nodiscard]] std::optional<Experience> experience_of(const Predictor& predictor,
                                                      const std::string& stick = "-");

/// The model that sticks began with, its last layer as they have taught it together, with their trust, without provenance. Throws
/// std::invalid_argument for an experience of a model of another size.
[[nodiscard]] PathModel taught(const PathModel& model, std::span<const Experience> experiences);

}  // namespace tracking
