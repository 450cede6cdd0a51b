#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compare/prediction_error.h"

namespace app {

/// Whether a specification is one of the baselines: hold, naive, difference, least-squares.
[[nodiscard]] bool is_baseline(const std::string& specification);
/// The name before the colon.
[[nodiscard]] std::string family_of(const std::string& specification);

/// The specifications among which tuning chooses for a family: a small grid, its densities logarithmic. The
/// filters get the sensor's noise (0: not known, their own 0.25 mm). Empty for a family without
/// parameters.
[[nodiscard]] std::vector<std::string> tuning_grid(const std::string& family, double noise_mm = 0);

/// The families among specifications that have parameters to tune, each once.
[[nodiscard]] std::vector<std::string> tunable_families(const std::vector<std::string>& specifications);

/// The position errors of every candidate on every recording at every lead.
class TuningTable {
public:
    /// Candidates are `specifications` and the grids of `families` behind them. `sticks` by recording;
    /// recordings are numbered 0 ... recordings - 1. Work is shared out to `threads`.
    TuningTable(std::vector<std::string> specifications, const std::vector<std::string>& families,
                double noise_mm, std::span<const SensedStick> sticks, std::size_t recordings,
                unsigned threads);

    /// The candidate of `family` with the least RMS at a lead over the recordings that are `allowed`, pooled
    /// over samples; of equals the first. None without candidates or without samples.
    [[nodiscard]] std::optional<std::size_t> best(const std::string& family, std::size_t lead,
                                                  const std::vector<bool>& allowed) const;
    [[nodiscard]] const std::string& specification(std::size_t candidate) const {
        return specifications_[candidate];
    }
    [[nodiscard]] const SquareSum& sum(std::size_t candidate, std::size_t recording, std::size_t lead) const {
        return sums_[(candidate * recordings_ + recording) * leads_ + lead];
    }
    [[nodiscard]] std::size_t recordings() const { return recordings_; }

private:
    std::vector<std::string> specifications_;
    std::size_t recordings_, leads_;
    std::vector<SquareSum> sums_;  // candidates x recordings x leads
};

}  // namespace app
