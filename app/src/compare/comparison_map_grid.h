#pragma once
#include <string>

#include "compare/comparison.h"

namespace app {

/// The map on one screen: a sentence a lead (in how many sensors which estimator gains), then a table a lead,
/// sensors down (rate, jitter, drop-outs), noise across; a cell names the best estimator and its gain over
/// the best baseline with the 95 % interval. Empty without a map.
[[nodiscard]] std::string map_grids(const Comparison& comparison);

/// "66.7 ms ahead an estimator gains in 40 of 64 sensors, 3.1 % in the median (cv* 30, singer* 10)", of one
/// lead; empty without a map.
[[nodiscard]] std::string map_sentence(const Comparison& comparison, double lead_s);

}  // namespace app
