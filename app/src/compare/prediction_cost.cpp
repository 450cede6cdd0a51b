#include "compare/prediction_cost.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "statistics/statistics.h"
#include "sticks/replay.h"

namespace app {
namespace {

constexpr std::size_t kPasses = 7, kMostSamples = 4096;

/// Keeps the compiler from removing an unread result.
void keep(double value) {
    asm volatile("" : : "g"(value) : "memory");
}

}  // namespace

double nanoseconds_per_sample(const std::string& specification, std::span<const tracking::PoseSample> samples,
                              std::span<const double> leads_s) {
    const std::span<const tracking::PoseSample> timed = samples.first(std::min(samples.size(), kMostSamples));
    std::vector<double> costs;
    for (std::size_t pass = 0; pass < kPasses; ++pass) {
        const auto predictor = make_any_predictor(specification, leads_s);
        const auto start = std::chrono::steady_clock::now();
        replay(*predictor, timed, [&](const ReplayedSample& now) {
            for (const double lead_s : leads_s) keep(predictor->predict(lead_s + now.behind_s).position.x());
        });
        const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
        costs.push_back(spent.count() / static_cast<double>(timed.size()));
    }
    return quantile(std::move(costs), 0.5);
}

}  // namespace app
