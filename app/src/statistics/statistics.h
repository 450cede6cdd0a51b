#pragma once
#include <vector>

namespace app {

/// The middle value; the mean of the two middle ones for an even count. 0 for no values.
[[nodiscard]] double median(std::vector<double> values);

/// Nearest-rank percentile: the smallest value that at least percent % of the values do not exceed, i.e. the
/// ceil(percent/100 n)-th. 0 for no values; percent in (0, 100].
[[nodiscard]] double nearest_rank(std::vector<double> values, double percent);

/// Value below which the share `p` of the values lies (the nearest of them, no interpolation). `values` is
/// not empty.
[[nodiscard]] double quantile(std::vector<double> values, double p);

}  // namespace app
