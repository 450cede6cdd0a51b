#include "statistics/paired_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "statistics/statistics.h"

namespace app {
namespace {

constexpr std::size_t kResamples = 2000;

struct Rms {
    double a = 0, b = 0;
};

Rms pooled(const PairedSums& sums) {
    const double count = std::max(1.0, static_cast<double>(sums.count));
    return {std::sqrt(sums.sum_a / count), std::sqrt(sums.sum_b / count)};
}

double ratio_of(const Rms& rms) {
    if (rms.b > 0) return rms.a / rms.b;
    return rms.a > 0 ? HUGE_VAL : 1;
}

void add(PairedSums& sum, const PairedSums& other) {
    sum.sum_a += other.sum_a;
    sum.sum_b += other.sum_b;
    sum.count += other.count;
}

/// Of 95 %.
std::pair<double, double> interval(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return {quantile_of_sorted(values, 0.025), quantile_of_sorted(values, 0.975)};
}

}  // namespace

PairedDifference paired_difference(std::span<const PairedSums> groups, std::uint64_t seed) {
    PairedDifference result;
    PairedSums whole;
    for (const PairedSums& group : groups) add(whole, group);
    const Rms rms = pooled(whole);
    result.n = groups.size();
    result.ratio = ratio_of(rms);
    result.difference_mm = rms.a - rms.b;
    if (groups.size() < 2) return result;
    std::mt19937_64 random(seed);
    std::vector<double> ratios, differences;
    for (std::size_t i = 0; i < kResamples; ++i) {
        PairedSums drawn;
        // The remainder favours the first groups by less than 1e-17.
        for (std::size_t k = 0; k < groups.size(); ++k) add(drawn, groups[random() % groups.size()]);
        const Rms resampled = pooled(drawn);
        ratios.push_back(ratio_of(resampled));
        differences.push_back(resampled.a - resampled.b);
    }
    std::tie(result.low, result.high) = interval(ratios);
    std::tie(result.difference_low_mm, result.difference_high_mm) = interval(differences);
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
