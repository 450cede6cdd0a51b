#pragma once
#include <cstddef>
#include <limits>
#include <span>
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

}  // namespace app
