#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "statistics/statistics.h"

namespace app {

/// Squared errors [mm^2] of two predictors on the same samples of one recording (or person).
struct PairedSums {
    SquareSum a, b;

    void add(const PairedSums& other) { a.add(other.a), b.add(other.b); }
};

/// The ratio RMS of a / RMS of b, pooled over n groups, with the 95 % interval of a bootstrap over the
/// groups: each group is drawn with its pair, so what both share cancels. Below 1: a errs less.
struct PairedDifference {
    std::size_t n = 0;         ///< groups
    double ratio = 1;          ///< of the RMS errors; infinite where only b errs nothing
    double low = 1, high = 1;  ///< 95 % interval of the ratio; meaningless for n < 2
    double difference_mm = 0, difference_low_mm = 0, difference_high_mm = 0;  ///< RMS of a - RMS of b

    [[nodiscard]] bool has_interval() const { return n >= 2; }
    [[nodiscard]] bool gain() const { return has_interval() && high < 1; }
    [[nodiscard]] bool loss() const { return has_interval() && low > 1; }
};

/// Percentile bootstrap, kResamples draws of n groups with replacement from a generator seeded by `seed`;
/// independent of the standard library's distributions.
[[nodiscard]] PairedDifference paired_difference(std::span<const PairedSums> groups, std::uint64_t seed);

/// "3.1 % better (0.95 to 0.99, n = 24)", "no measurable gain (0.98 to 1.02, n = 24)", "4.0 % worse (...)",
/// or that n is too small for an interval, or the baseline without error.
[[nodiscard]] std::string verdict(const PairedDifference& difference);

}  // namespace app
