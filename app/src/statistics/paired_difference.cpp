#include "statistics/paired_difference.h"

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <vector>

namespace app {
namespace {

constexpr std::size_t kResamples = 2000;

double ratio_of(const PairedSums& sums) {
    const double a = sums.a.rms(), b = sums.b.rms();
    if (b > 0) return a / b;
    return a > 0 ? HUGE_VAL : 1;
}

}  // namespace

PairedDifference paired_difference(std::span<const PairedSums> groups, std::uint64_t seed) {
    PairedDifference result;
    PairedSums whole;
    for (const PairedSums& group : groups) whole.add(group);
    result.n = groups.size();
    result.ratio = ratio_of(whole);
    result.difference_mm = whole.a.rms() - whole.b.rms();
    if (groups.size() < 2) return result;
    std::mt19937_64 random(seed);
    std::vector<double> ratios, differences;
    for (std::size_t i = 0; i < kResamples; ++i) {
        PairedSums drawn;
        // The remainder favours the first groups by less than 1e-17.
        for (std::size_t k = 0; k < groups.size(); ++k) drawn.add(groups[random() % groups.size()]);
        ratios.push_back(ratio_of(drawn));
        differences.push_back(drawn.a.rms() - drawn.b.rms());
    }
    constexpr double kLow = 0.025, kHigh = 0.975;  // of 95 %
    result.low = quantile_in_place(ratios, kLow);
    result.high = quantile_in_place(ratios, kHigh);
    result.difference_low_mm = quantile_in_place(differences, kLow);
    result.difference_high_mm = quantile_in_place(differences, kHigh);
    return result;
}

std::string verdict(const PairedDifference& d) {
    if (std::isinf(d.ratio)) return "the baseline errs nothing, so there is no ratio";
    if (!d.has_interval())
        return fmt::format("ratio {:.3f}; no interval from one recording or person", d.ratio);
    const std::string high = std::isinf(d.high) ? "no bound" : fmt::format("{:.3f}", d.high);
    const std::string range = fmt::format("({:.3f} to {}, n = {})", d.low, high, d.n);
    if (d.gain()) return fmt::format("{:.1f} % better {}", 100 * (1 - d.ratio), range);
    if (d.loss()) return fmt::format("{:.1f} % worse {}", 100 * (d.ratio - 1), range);
    return fmt::format("no measurable gain {}", range);
}

}  // namespace app
