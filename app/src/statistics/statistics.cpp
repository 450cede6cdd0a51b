#include "statistics/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>
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

constexpr std::size_t kResamples = 10000;

double ratio_of(const PairedSums& sums) {
    const double a = sums.a.rms(), b = sums.b.rms();
    if (b > 0) return a / b;
    return a > 0 ? HUGE_VAL : 1;
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

PairedDifference paired_difference(std::span<const PairedSums> groups, std::uint64_t seed, std::size_t fewest,
                                   std::size_t together) {
    PairedDifference result;
    PairedSums whole;
    for (const PairedSums& group : groups) whole.add(group);
    result.n = groups.size();
    result.ratio = ratio_of(whole);
    result.difference_mm = whole.a.rms() - whole.b.rms();
    if (groups.size() < fewest) {
        for (const PairedSums& group : groups) result.ratios.push_back(ratio_of(group));
        return result;
    }
    std::mt19937_64 random(seed);
    std::vector<double> ratios, differences;
    for (std::size_t i = 0; i < kResamples; ++i) {
        PairedSums drawn;
        // The remainder favours the first groups by less than 1e-17.
        for (std::size_t k = 0; k < groups.size(); ++k) drawn.add(groups[random() % groups.size()]);
        ratios.push_back(ratio_of(drawn));
        differences.push_back(drawn.a.rms() - drawn.b.rms());
    }
    const double below = 0.025 / static_cast<double>(std::max<std::size_t>(1, together));
    result.low = quantile_in_place(ratios, below);
    result.high = quantile_in_place(ratios, 1 - below);
    result.difference_low_mm = quantile_in_place(differences, below);
    result.difference_high_mm = quantile_in_place(differences, 1 - below);
    return result;
}

std::string verdict(const PairedDifference& d) {
    if (std::isinf(d.ratio)) return "the baseline errs nothing, so there is no ratio";
    if (!d.has_interval())
        return fmt::format("ratio {:.3f}, no interval from so few ({:.3f})", d.ratio,
                           fmt::join(d.ratios, ", "));
    const auto percent = [](double ratio) { return 100 * std::abs(1 - ratio); };
    if (d.gain())
        return fmt::format("{:.1f} % better ({:.1f} to {:.1f} %, n = {})", percent(d.ratio), percent(d.high),
                           percent(d.low), d.n);
    if (d.loss())
        return fmt::format("{:.1f} % worse ({:.1f} to {}, n = {})", percent(d.ratio), percent(d.low),
                           std::isinf(d.high) ? "no bound" : fmt::format("{:.1f} %", percent(d.high)), d.n);
    const std::string worst =
        std::isinf(d.high) ? "worse without bound" : fmt::format("{:.1f} % worse", percent(d.high));
    return fmt::format("no measurable gain ({} to {:.1f} % better, n = {})", worst, percent(d.low), d.n);
}

}  // namespace app
