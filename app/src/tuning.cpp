#include "tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.h"
#include "predictors.h"

namespace app {
namespace {

/// Two values a decade: 1e4, 3e4, 1e5, ... up to `last` (powers of ten).
std::vector<std::string> densities(int first, int last) {
    std::vector<std::string> values;
    for (int power = first; power <= last; ++power) {
        values.push_back(fmt::format("1e{}", power));
        if (power < last) values.push_back(fmt::format("3e{}", power));
    }
    return values;
}

/// FORMAT with each value in place of its {}.
std::vector<std::string> filled(const std::string& before, const std::vector<std::string>& values) {
    std::vector<std::string> specifications;
    specifications.reserve(values.size());
    for (const std::string& value : values) specifications.push_back(before + value);
    return specifications;
}

std::vector<std::string> crossed(const std::string& first, const std::vector<std::string>& a,
                                 const std::string& second, const std::vector<std::string>& b) {
    std::vector<std::string> specifications;
    for (const std::string& x : a)
        for (const std::string& y : filled(fmt::format("{}{}{}", first, x, second), b))
            specifications.push_back(y);
    return specifications;
}

std::vector<std::string> grid_of(const std::string& family) {
    if (family == "naive") return filled("naive:n=", {"1", "2", "3", "4", "5", "6", "8", "11", "16"});
    if (family == "least-squares") {
        std::vector<std::string> grid =
            filled("least-squares:degree=1,n=", {"2", "3", "4", "5", "6", "8", "12", "16"});
        for (const std::string& more :
             filled("least-squares:degree=2,n=", {"3", "4", "5", "6", "8", "10", "12", "16", "24"}))
            grid.push_back(more);
        return grid;
    }
    if (family == "cv") return filled("cv:q=", densities(4, 12));
    if (family == "ca") return filled("ca:q=", densities(5, 14));
    if (family == "singer")
        return crossed("singer:alpha=", {"1", "3", "10", "20", "40", "100"}, ",q=", densities(6, 14));
    if (family == "double-exponential")
        return filled("double-exponential:a=",
                      {"0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "0.95", "0.98"});
    return {};
}

}  // namespace

std::string family_of(const std::string& specification) {
    return specification.substr(0, specification.find(':'));
}

bool is_baseline(const std::string& specification) {
    const std::string family = family_of(specification);
    return family == "hold" || family == "naive" || family == "difference" || family == "least-squares";
}

std::vector<std::string> tuning_grid(const std::string& family) {
    const std::vector<std::string>& known = tracking::predictor_names();
    if (std::find(known.begin(), known.end(), family) == known.end()) return {};
    return grid_of(family);
}

std::vector<std::string> candidates_of(const std::vector<std::string>& families) {
    std::vector<std::string> all;
    for (const std::string& family : families)
        for (const std::string& specification : tuning_grid(family)) all.push_back(specification);
    return all;
}

TuningTable::TuningTable(const std::vector<std::string>& specifications, std::span<const SensedStick> sticks,
                         std::size_t recordings, unsigned threads, const std::function<void(double)>& done)
    : specifications_(specifications),
      recordings_(recordings),
      leads_(sticks.empty() ? 0 : sticks.front().leads_s.size()),
      sums_(specifications.size() * recordings * leads_) {
    const auto work = [&](std::size_t candidate) {
        for (const SensedStick& stick : sticks) {
            const auto predictor = make_any_predictor(specifications_[candidate], stick.leads_s);
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_; ++lead)
                sums_[(candidate * recordings_ + stick.recording) * leads_ + lead].add(scored[lead]);
        }
    };
    parallel_for(specifications_.size(), threads, work, done);
}

std::size_t TuningTable::best(const std::string& family, std::size_t lead,
                              const std::vector<bool>& allowed) const {
    std::size_t best = npos;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t candidate = 0; candidate < specifications_.size(); ++candidate) {
        if (family_of(specifications_[candidate]) != family) continue;
        SquareSum pooled;
        for (std::size_t r = 0; r < recordings_; ++r)
            if (allowed[r]) pooled.add(sum(candidate, r, lead));
        if (pooled.count == 0 || !(pooled.rms_mm() < least)) continue;
        least = pooled.rms_mm();
        best = candidate;
    }
    return best;
}

}  // namespace app
