#pragma once
#include <span>
#include <string>
#include <vector>

#include "comparison.h"
#include "recording.h"
#include "sensed_stick.h"

namespace app {

/// Where a predictor's parameters come from.
enum class Tuning {
    none,              ///< as named
    other_recordings,  ///< `NAME*`: least RMS on recordings other than the one scored
    other_persons,     ///< `NAME**`: least RMS on recordings of other persons
};

/// A predictor that takes part in a comparison.
struct Entrant {
    std::string name;         ///< as shown: `naive`, `naive*`
    std::string description;  ///< one line
    Tuning tuning = Tuning::none;
    bool baseline = false, external = false;
    std::vector<std::vector<std::string>> used;  ///< recording x lead: the specification that runs
};

struct EntrantList {
    std::vector<Entrant> entrants;
    std::string tuned_on;  ///< what the tuned ones were tuned on, one sentence
};

/// The predictors named, without repetitions, and the baselines (naive, difference, the parabola).
[[nodiscard]] std::vector<std::string> specifications_of(const ComparisonOptions& options);

/// Those named, then the baselines that were not (naive, difference, the parabola), then the tuned ones of
/// each family among them: on the `--tune` recordings without the one scored, or on all others compared (two
/// recordings or more), and on those of other persons (two persons or more). Throws BadInput for a predictor
/// that is not known.
[[nodiscard]] EntrantList enter(const ComparisonOptions& options, std::span<const Recording> recordings,
                                std::span<const SensedStick> sticks);

}  // namespace app
