#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "compare/comparison.h"
#include "sticks/prediction_file.h"

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
    /// Candidates are `specifications` and the grids of `families` behind them. `sticks`: all of the
    /// recordings, in their order. Work is shared out to `threads`.
    TuningTable(std::vector<std::string> specifications, const std::vector<std::string>& families,
                double noise_mm, std::span<const SensedStick> sticks, unsigned threads);

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

/// Where a predictor's parameters come from.
enum class Tuning {
    none,              ///< as named
    other_recordings,  ///< `NAME*`: least RMS on recordings other than the one scored
    other_persons,     ///< `NAME**`: least RMS on recordings of other persons
};

/// A predictor that takes part in a comparison.
struct Entrant {
    std::string name;         ///< as shown: `naive`, `naive*`
    std::string description;  ///< one line
    Tuning tuning = Tuning::none;
    bool baseline = false, external = false;
    /// Of `auto`, else empty: the specification that is scored on strikes, at an advance that is learned from
    /// other recordings, and the one that confirms them.
    std::string strikes_by = {}, confirmed_by = {};
    std::shared_ptr<const tracking::PathModel> contacts = {};  ///< heard about strikes, where there is one
    /// Recording x lead: the specification that runs, or the file that answers; empty: does not take part.
    std::vector<std::vector<std::string>> used = {};
    std::map<std::pair<std::size_t, std::size_t>, StickPredictions> replays =
        {};                                                 ///< (stick among all, lead): the file's answers
    std::shared_ptr<const tracking::PathModel> model = {};  ///< that runs, in place of a file's
};

/// The leads that one predictor serves in one pass: those for which the same specification runs.
[[nodiscard]] std::vector<std::vector<std::size_t>> passes_of(const Entrant& entrant, std::size_t recording);

/// A fresh predictor at a lead at which `used` is not empty; `leads_s` will be asked for. `instead`: the
/// specification that runs unless it is empty or a file answers.
[[nodiscard]] std::unique_ptr<tracking::Predictor> make_entrant(const Entrant& entrant,
                                                                const SensedStick& stick, std::size_t lead,
                                                                std::span<const double> leads_s,
                                                                const std::string& instead = {});

/// The strikes of an entrant on one stick of a field, by what runs at `lead`, an index.
[[nodiscard]] HitScore strikes_of(const Entrant& entrant, const Field& field, const SensedStick& stick,
                                  std::size_t lead, const ComparisonOptions& options,
                                  const StrikeTiming& timing);

struct EntrantList {
    std::vector<Entrant> entrants;
    std::string tuned_on;  ///< what the tuned ones were tuned on, one sentence
};

/// The predictors named, without repetitions, and the baselines (hold, naive, difference, the parabola).
[[nodiscard]] std::vector<std::string> specifications_of(const ComparisonOptions& options);

/// Those named, then the baselines that were not (hold, naive, difference, the parabola), then the tuned ones of
/// each family among them: on `tuning` (of --tune) without the one scored (known by its samples), or, if that
/// is empty, on all others scored (two recordings or more), and on those of other persons (two persons or
/// more); last the files of `--predictions`, each at its lead on the recording whose samples it answers.
/// Throws BadInput for a predictor that is not known and a file that fits no recording or lead.
[[nodiscard]] EntrantList enter(const ComparisonOptions& options, const Field& scored, const Field& tuning);

}  // namespace app
