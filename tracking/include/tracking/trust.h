#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "tracking/predictor.h"

namespace tracking {

struct PathModel;

/// How far the network of a stick had proven itself against its filter when a performance ended (predictor
/// `arbitrated`): what the next one begins with.
struct Trust {
    static constexpr std::size_t kLeads = 5;
    static constexpr double kMostLog = 40;  ///< of a radius either way: finite whatever comes

    /// The sums of an arbiter: over the errors e_F of the filter and e_M of the model and over the way M - F between
    /// them, each weighing its share of time.
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
    /// What the stated covariances turned out to be worth: of `errors` errors, the mean of their squared distances in
    /// units of the covariance.
    struct Scale {
        double errors = 0, mean = 3;
        Radii radii;
    };
    /// Of one lead of the network: of the position, and of the shaft's direction (without unit in place of m).
    struct Lead {
        Sums position, shaft;
        Scale regions;
    };

    std::string stick;  ///< its name
    std::array<Lead, kLeads> leads;
};

/// Before the first sample: begins with the trust that the model has in the stick of that name, if it has any and the
/// predictor weighs a network.
void begin_with_trust(Predictor& predictor, const PathModel& model, std::string_view stick);

}  // namespace tracking
