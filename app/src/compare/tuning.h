#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "compare/prediction_error.h"
#include "compare/sensed_stick.h"

namespace app {

/// Whether a specification is one of the baselines: hold, naive, difference, least-squares.
[[nodiscard]] bool is_baseline(const std::string& specification);
/// The name before the colon.
[[nodiscard]] std::string family_of(const std::string& specification);

/// The specifications among which tuning chooses for a family: a small grid, its densities logarithmic. The
/// filters get the sensor's noise (0: not known, their own 0.25 mm). Empty for a family without
/// parameters.
[[nodiscard]] std::vector<std::string> tuning_grid(const std::string& family, double noise_mm = 0);

/// The position errors of every candidate on every recording at every lead.
class TuningTable {
public:
    /// `sticks` by recording; recordings are numbered 0 ... recordings - 1. Work is shared out to `threads`.
    TuningTable(const std::vector<std::string>& specifications, std::span<const SensedStick> sticks,
                std::size_t recordings, unsigned threads, const std::function<void(double)>& done = {});

    /// The candidate of `family` with the least RMS at a lead over the recordings that are `allowed`, pooled
    /// over samples; of equals the first. npos without candidates or without samples.
    [[nodiscard]] std::size_t best(const std::string& family, std::size_t lead,
                                   const std::vector<bool>& allowed) const;
    [[nodiscard]] const std::string& specification(std::size_t candidate) const {
        return specifications_[candidate];
    }
    [[nodiscard]] const SquareSum& sum(std::size_t candidate, std::size_t recording, std::size_t lead) const {
        return sums_[(candidate * recordings_ + recording) * leads_ + lead];
    }
    [[nodiscard]] std::size_t recordings() const { return recordings_; }

    static constexpr std::size_t npos = static_cast<std::size_t>(-1);

private:
    std::vector<std::string> specifications_;
    std::size_t recordings_, leads_;
    std::vector<SquareSum> sums_;  // candidates x recordings x leads
};

/// The grids of several families in one list.
[[nodiscard]] std::vector<std::string> candidates_of(const std::vector<std::string>& families,
                                                     double noise_mm);

}  // namespace app
