#include "statistics/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace app {
namespace {

/// The index of x_k, from 0, and h - k.
std::pair<std::size_t, double> place_of(std::size_t count, double p) {
    assert(p >= 0 && p <= 1 && "a quantile is of a share from 0 to 1");
    const double at = p * static_cast<double>(count - 1);
    const auto below = static_cast<std::size_t>(at);
    return {below, at - static_cast<double>(below)};
}

/// Infinite neighbours, too, have what lies between them.
double between(double low, double high, double fraction) {
    return low == high ? low : std::lerp(low, high, fraction);
}

}  // namespace

double quantile_of_sorted(std::span<const double> sorted, double p) noexcept {
    if (sorted.empty()) return kNoValue;
    const auto [below, fraction] = place_of(sorted.size(), p);
    return between(sorted[below], sorted[std::min(below + 1, sorted.size() - 1)], fraction);
}

double quantile_in_place(std::span<double> values, double p) noexcept {
    if (values.empty()) return kNoValue;
    const auto [below, fraction] = place_of(values.size(), p);
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(below);
    std::nth_element(values.begin(), nth, values.end());
    if (fraction == 0) return *nth;
    return between(*nth, *std::min_element(nth + 1, values.end()), fraction);
}

double quantile(std::vector<double> values, double p) {
    return quantile_in_place(values, p);
}

double SquareSum::rms() const {
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

double median(std::vector<double> values) {
    return quantile(std::move(values), 0.5);
}

}  // namespace app
