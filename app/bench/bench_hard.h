#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "bench/hard_watch.h"
#include "commands/bench_options.h"

namespace app {

/// One scene by one engine, in one setting, at one step.
struct HardRun {
    std::string scene, engine, version, settings;
    double dt_s = 0;
    int halvings = 0;     ///< of the scene's step
    double ms_per_s = 0;  ///< processor time for a simulated second, steps alone [ms]
    HardFigures figures;
};

/// The runs of one engine in one setting, steps from long to short.
struct HardEntrant {
    std::vector<HardRun> runs;
};

/// One scene: ours first, as the scene says; then ours in other settings, and peers.
struct HardComparison {
    HardScene scene;
    double seconds = 0;  ///< of simulated time
    std::vector<HardEntrant> entrants;

    /// Ours as the scene says, at its step.
    [[nodiscard]] const HardRun& ours() const { return entrants.front().runs.front(); }
    /// The error of ours, or what is least; where ours is not right any that the scene's limit allows.
    [[nodiscard]] double equal_error() const;
    [[nodiscard]] bool is_equal(const HardRun& run) const {
        return run.figures.right && run.figures.error <= equal_error();
    }
    /// The cheapest run at equal error; nullptr: none.
    [[nodiscard]] const HardRun* best_of(const HardEntrant& entrant) const;
    [[nodiscard]] const HardRun* best_of(const std::string& engine) const;
    /// Other engines, in order.
    [[nodiscard]] std::vector<std::string> peers() const;
};

struct HardBench {
    std::vector<HardComparison> scenes;
    std::vector<std::string> notes;
};

/// An error below this counts as this: one peer computes in single precision, and rest has its slop.
inline constexpr double kLeastError = 1e-4;

/// Runs bundled hard scenes with our World, and with the peers that this program was built with, rigid. The
/// step is halved until an entrant is right and errs no more than ours, at most options.halvings times.
/// `progress` gets a line now and then.
[[nodiscard]] HardBench bench_hard(const HardBenchOptions& options,
                                   const std::function<void(const std::string&)>& progress);

/// Text: a row of each entrant at the scene's step. JSON: machine, results (ours beside each peer's best at equal
/// error), runs, notes. Table: a row of each run. Plot: processor time at equal error, by scene. Page: tables
/// and plots.
[[nodiscard]] Figures figures_of(const HardBench& bench);

}  // namespace app
