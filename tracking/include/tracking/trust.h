#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "tracking/predictor.h"

namespace tracking {

struct PathModel;

/// The errors of a stick's network beside those of its filter when a performance ended (predictor
/// `arbitrated`). The next performance begins with them.
struct Trust {
    static constexpr std::size_t kLeads = 5;
    static constexpr double kMostLog = 40;  ///< of a radius either way: finite whatever comes

    /// The sums of an Arbiter, over time: of the errors e_F of the filter and e_M of the model, and of the
    /// difference M - F of their predictions.
    struct Sums {
        double known_s = 0;        ///< errors of so long are known [s]
        double against = 0;        ///< of -e_F.(M - F), weights exp(-age / 2 s) [m^2 s]
        double square = 0;         ///< of |M - F|^2, likewise
        double filter_recent = 0;  ///< of |e_F|^2, likewise
        double filter_square = 0;  ///< of |e_F|^2, weights exp(-age / 10 s)
        double model_square = 0;   ///< of |e_M|^2, likewise
    };
    /// Logarithms of the squared radii of the regions of 50 and 95 %, in units of the covariance without its factor.
    struct Radii {
        double log_50 = std::log(kRadius50), log_95 = std::log(kRadius95);
    };
    /// Calibration of the stated covariances: the mean squared Mahalanobis distance of `errors` errors.
    struct Scale {
        double errors = 0, mean = 3;
        Radii radii;
    };
    /// For one lead of the network. The shaft's direction has no unit where the position has m.
    struct Lead {
        Sums position, shaft;
        Scale regions;
    };

    std::string stick;  ///< its name
    std::array<Lead, kLeads> leads;
};

/// Restores the trust that the model holds for the stick of that name, before the first sample. Does nothing
/// where the model holds none, or the predictor is not `arbitrated`.
void begin_with_trust(Predictor& predictor, const PathModel& model, std::string_view stick);

}  // namespace tracking
