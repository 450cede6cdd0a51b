#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "tracking/path_model.h"
#include "tracking/predictor.h"

namespace tracking {

/// What a stick has taught the network of a predictor (`online`, `arbitrated`): the sums A (its lower triangle) and B of
/// OnlineLayer.
struct Experience {
    Eigen::MatrixXd moments, against;  ///< n x n, n x 30

    /// And what was learned elsewhere from the same model.
    Experience& operator+=(const Experience& other) {
        moments += other.moments;
        against += other.against;
        return *this;
    }
};

/// None of a predictor that does not learn.
[[nodiscard]] std::optional<Experience> experience_of(const Predictor& predictor);

/// The model that sticks began with, its last layer as they have taught it together, without provenance. Throws
/// std::invalid_argument for an experience of a model of another size.
[[nodiscard]] PathModel taught(const PathModel& model, std::span<const Experience> experiences);

}  // namespace tracking
