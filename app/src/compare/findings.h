#pragma once
#include <string>
#include <vector>

#include "compare/comparison.h"

namespace app {

// What a comparison finds, in sentences.

/// "33.3 ms ahead singer* errs least, ...; of 292 true strikes ca predicts most, ...", a sentence a lead.
[[nodiscard]] std::vector<std::string> winners(const Comparison& comparison);

/// A caution: the winners' intervals do not include among how many they were picked.
[[nodiscard]] std::string selection_caution(const Comparison& comparison);

/// "66.7 ms ahead an estimator gains in 40 of 64 sensors, 3.1 % in the median (cv* 30, singer* 10)", of one
/// lead; empty without a map.
[[nodiscard]] std::string map_sentence(const Comparison& comparison, double lead_s);

/// The saving in % that a ratio of RMS errors is.
[[nodiscard]] inline double gain_percent(double ratio) {
    return 100 * (1 - ratio);
}

}  // namespace app
