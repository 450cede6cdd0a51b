#include "compare/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "process/parallel.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kNoiseMm = 0.25;  // what the filters assume unless told

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

/// Every combination of one of `a` before one of `b`.
std::vector<std::string> crossed(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    std::vector<std::string> specifications;
    for (const std::string& x : a)
        for (const std::string& specification : filled(x, b)) specifications.push_back(specification);
    return specifications;
}

std::vector<std::string> least_squares_grid() {
    std::vector<std::string> grid =
        filled("least-squares:degree=1,n=", {"2", "3", "4", "5", "6", "8", "12", "16"});
    for (const std::string& parabola :
         filled("least-squares:degree=2,n=", {"3", "4", "5", "6", "8", "12", "16", "24"}))
        grid.push_back(parabola);
    return grid;
}

/// Singer's densities: a decade each, from a slow hand to contacts.
std::vector<std::string> singer_grid() {
    return crossed(filled("singer:alpha=", {"3", "10", "30", "100", "300"}),
                   filled(",q=", {"1e7", "1e8", "1e9", "1e10", "1e11", "1e12", "1e13", "1e14"}));
}

std::vector<std::string> bank_grid() {
    return crossed(crossed(filled("bank:cv=", {"1e7", "1e8", "1e9"}), filled(",alpha=", {"10", "30", "100"})),
                   filled(",singer=", {"1e10", "1e11", "1e12"}));
}

std::vector<std::string> imm_grid() {
    return crossed(filled("imm:alpha=", {"3", "10", "30", "100"}),
                   {",q1=1e8,q2=3e9,q3=1e11", ",q1=1e9,q2=3e10,q3=1e12", ",q1=1e10,q2=3e11,q3=1e13"});
}

std::vector<std::string> one_euro_grid() {
    return crossed(crossed(filled("one-euro:min=", {"1", "2", "3", "5", "10", "20", "40"}),
                           filled(",beta=", {"0", "0.01", "0.1"})),
                   filled(",d=", {"10", "30", "100", "1000"}));
}

const std::map<std::string, std::function<std::vector<std::string>()>>& grids() {
    static const std::map<std::string, std::function<std::vector<std::string>()>> all = {
        {"naive",
         [] {
             return filled("naive:n=", {"1", "2", "3", "4", "5", "6", "8", "11", "16"});
         }},
        {"least-squares", least_squares_grid},
        {"double-exponential",
         [] {
             return filled("double-exponential:a=",
                           {"0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "0.95", "0.98"});
         }},
        {"one-euro", one_euro_grid},
        {"cv",
         [] {
             return crossed(filled("cv:q=", densities(4, 12)),
                            {"", ",decay=2", ",decay=4", ",decay=8", ",decay=16", ",decay=32"});
         }},
        {"ca", [] { return filled("ca:q=", densities(5, 14)); }},
        {"singer", singer_grid},
        {"bank", bank_grid},
        {"imm", imm_grid}};
    return all;
}

/// The families that are told the sensor's noise.
bool knows_noise(const std::string& family) {
    return family == "cv" || family == "ca" || family == "singer" || family == "bank" || family == "imm";
}

}  // namespace

std::string family_of(const std::string& specification) {
    return specification.substr(0, specification.find(':'));
}

bool is_baseline(const std::string& specification) {
    const std::string family = family_of(specification);
    return family == "hold" || family == "naive" || family == "difference" || family == "least-squares";
}

std::vector<std::string> tuning_grid(const std::string& family, double noise_mm) {
    const auto grid = grids().find(family);
    if (grid == grids().end()) return {};
    const bool told = knows_noise(family) && noise_mm > 0 && noise_mm != kNoiseMm;
    return told ? crossed(grid->second(), {fmt::format(",r={}", noise_mm)}) : grid->second();
}

std::vector<std::string> candidates_of(const std::vector<std::string>& families, double noise_mm) {
    std::vector<std::string> all;
    for (const std::string& family : families)
        for (const std::string& specification : tuning_grid(family, noise_mm)) all.push_back(specification);
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
