#include "compare/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>

#include "process/parallel.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kNoiseMm = 0.25;  // what the filters assume by default

/// What tuning tries of a family: every combination of one of each axis, the last axis fastest. An axis is words
/// with blanks between; a first one that ends in = stands before each of the others; - is the default.
struct Grid {
    const char* family;
    std::vector<const char*> axes;
};

/// Densities are two values a decade, of Singer's one, from a slow hand to contacts.
const std::vector<Grid>& grids() {
    static const std::vector<Grid> all = {
        {"naive", {"n= 1 2 3 4 5 6 8 11 16"}},
        {"least-squares", {"degree=1", "n= 2 3 4 5 6 8 12 16"}},
        {"least-squares", {"degree=2", "n= 3 4 5 6 8 12 16 24"}},
        {"double-exponential", {"a= 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 0.95 0.98"}},
        {"one-euro", {"min= 1 2 3 5 10 20 40", "beta= 0 0.01 0.1", "d= 10 30 100 1000"}},
        {"cv",
         {"q= 1e4 3e4 1e5 3e5 1e6 3e6 1e7 3e7 1e8 3e8 1e9 3e9 1e10 3e10 1e11 3e11 1e12",
          "- decay=2 decay=4 decay=8 decay=16 decay=32"}},
        {"ca", {"q= 1e5 3e5 1e6 3e6 1e7 3e7 1e8 3e8 1e9 3e9 1e10 3e10 1e11 3e11 1e12 3e12 1e13 3e13 1e14"}},
        {"singer", {"alpha= 3 10 30 100 300", "q= 1e7 1e8 1e9 1e10 1e11 1e12 1e13 1e14"}},
        {"bank", {"cv= 1e7 1e8 1e9", "alpha= 10 30 100", "singer= 1e10 1e11 1e12"}},
        {"imm",
         {"alpha= 3 10 30 100", "q1=1e8,q2=3e9,q3=1e11 q1=1e9,q2=3e10,q3=1e12 q1=1e10,q2=3e11,q3=1e13"}}};
    return all;
}

/// Each specification with each parameter of an axis.
std::vector<std::string> crossed(const std::vector<std::string>& specifications, const std::string& axis) {
    std::vector<std::string> all;
    for (const std::string& specification : specifications) {
        std::istringstream words(axis);
        std::string name;
        for (std::string word; words >> word;) {
            const char* before = specification.find(':') == std::string::npos ? ":" : ",";
            if (word.ends_with('='))
                name = word;
            else
                all.push_back(word == "-" ? specification : specification + before + name + word);
        }
    }
    return all;
}

/// The families that get the sensor's noise.
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
    const bool told = knows_noise(family) && noise_mm > 0 && noise_mm != kNoiseMm;
    std::vector<std::string> all;
    for (const Grid& grid : grids()) {
        if (grid.family != family) continue;
        std::vector<std::string> specifications = {family};
        for (const char* axis : grid.axes) specifications = crossed(specifications, axis);
        if (told) specifications = crossed(specifications, fmt::format("r={}", noise_mm));
        std::ranges::move(specifications, std::back_inserter(all));
    }
    return all;
}

std::vector<std::string> tunable_families(const std::vector<std::string>& specifications) {
    std::vector<std::string> families;
    for (const std::string& specification : specifications) {
        const std::string family = family_of(specification);
        if (!tuning_grid(family).empty() && std::ranges::find(families, family) == families.end())
            families.push_back(family);
    }
    return families;
}

TuningTable::TuningTable(std::vector<std::string> specifications, const std::vector<std::string>& families,
                         double noise_mm, std::span<const SensedStick> sticks, std::size_t recordings,
                         unsigned threads)
    : specifications_(std::move(specifications)),
      recordings_(recordings),
      leads_(sticks.empty() ? 0 : sticks.front().leads_s.size()) {
    for (const std::string& family : families)
        std::ranges::move(tuning_grid(family, noise_mm), std::back_inserter(specifications_));
    sums_.resize(specifications_.size() * recordings_ * leads_);
    parallel_for(specifications_.size(), threads, [&](std::size_t candidate) {
        for (const SensedStick& stick : sticks) {
            const auto predictor = make_any_predictor(specifications_[candidate], stick.leads_s);
            const std::vector<SquareSum> scored = score_positions(stick, *predictor);
            for (std::size_t lead = 0; lead < leads_; ++lead)
                sums_[(candidate * recordings_ + stick.recording) * leads_ + lead].add(scored[lead]);
        }
    });
}

std::optional<std::size_t> TuningTable::best(const std::string& family, std::size_t lead,
                                             const std::vector<bool>& allowed) const {
    std::optional<std::size_t> best;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t candidate = 0; candidate < specifications_.size(); ++candidate) {
        if (family_of(specifications_[candidate]) != family) continue;
        SquareSum pooled;
        for (std::size_t r = 0; r < recordings_; ++r)
            if (allowed[r]) pooled.add(sum(candidate, r, lead));
        if (pooled.count == 0 || !(pooled.rms() < least)) continue;
        least = pooled.rms();
        best = candidate;
    }
    return best;
}

}  // namespace app
