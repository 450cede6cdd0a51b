#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace app {

// Quantiles as everywhere in the program: definition 7 of Hyndman and Fan, "Sample Quantiles in Statistical
// Packages", 1996 (numpy's default), linear between the order statistics x_1 <= ... <= x_n:
//   Q(p) = x_k + (h - k) (x_(k+1) - x_k),  h = 1 + (n - 1) p,  k = floor(h),  0 <= p <= 1
// A quantile of no values is kNoValue, NaN, which tables, CSV and JSON show as none.

/// What a figure of nothing is.
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

[[nodiscard]] double quantile(std::vector<double> values, double p);
/// The same without a copy: reorders `values`.
[[nodiscard]] double quantile_in_place(std::span<double> values, double p) noexcept;
/// The same of values that ascend.
[[nodiscard]] double quantile_of_sorted(std::span<const double> sorted, double p) noexcept;

/// A sum of squares and of how many.
struct SquareSum {
    double sum = 0;
    std::size_t count = 0;

    void add(double square) { sum += square, ++count; }
    void add(const SquareSum& other) { sum += other.sum, count += other.count; }
    [[nodiscard]] double rms() const;  ///< 0 of nothing
};

/// Q(0.5): the middle value, or the mean of the two in the middle.
[[nodiscard]] double median(std::vector<double> values);

/// Squared errors [mm^2] of two predictors on the same samples of one recording (or person).
struct PairedSums {
    SquareSum a, b;

    void add(const PairedSums& other) { a.add(other.a), b.add(other.b); }
};

/// The ratio RMS of a / RMS of b, pooled over n groups, with the interval of a bootstrap over the groups: each
/// group is drawn with its pair, so what both share cancels. Below 1: a errs less. Of too few groups a bootstrap
/// knows nothing: these have the single ratios instead.
struct PairedDifference {
    std::size_t n = 0;           ///< groups
    double ratio = 1;            ///< of the RMS errors; infinite where only b errs nothing
    double low = 1, high = 1;    ///< of the ratio; meaningless without has_interval()
    std::vector<double> ratios;  ///< of the groups, in their order; only without has_interval()
    double difference_mm = 0, difference_low_mm = 0, difference_high_mm = 0;  ///< RMS of a - RMS of b

    [[nodiscard]] bool has_interval() const { return ratios.empty() && n > 0; }
    [[nodiscard]] bool gain() const { return has_interval() && high < 1; }
    [[nodiscard]] bool loss() const { return has_interval() && low > 1; }
};

/// Percentile bootstrap, kResamples draws of n groups with replacement from a generator seeded by `seed`;
/// independent of the standard library's distributions. `fewest` >= 2: groups that make an interval. `together`:
/// how many differences there are whose intervals shall hold at 95 % all at once: each is of 1 - 0.05 / together
/// (Bonferroni 1936).
[[nodiscard]] PairedDifference paired_difference(std::span<const PairedSums> groups, std::uint64_t seed,
                                                 std::size_t fewest = 2, std::size_t together = 1);

/// "3.1 % better (1.0 to 5.1 %, n = 24)", "4.0 % worse (...)", "no measurable gain (2.0 % worse to 0.5 % better, n =
/// 24)", "ratio 0.912, no interval from so few (0.880, 0.940)", or that the baseline errs nothing.
[[nodiscard]] std::string verdict(const PairedDifference& difference);

}  // namespace app
