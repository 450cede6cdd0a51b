#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "bench/hard_watch.h"
#include "report/plot.h"

namespace app {

struct HardBenchOptions {
    std::vector<std::string> scenes;  ///< by name; none: all
    int halvings = 4;                 ///< of the scene's step, at most
    double longest_s = 20;            ///< of processor time: after a longer run the step is not halved again
};

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

/// Machine, results (ours beside each peer's best at equal error), runs, notes.
[[nodiscard]] std::string format_json(const HardBench& bench);
/// A row of each entrant at the scene's step.
[[nodiscard]] std::string format_text(const HardBench& bench);
/// A row of each run.
[[nodiscard]] std::string format_csv(const HardBench& bench);
/// Processor time at equal error, by scene.
[[nodiscard]] PlotScript hard_plot(const HardBench& bench);
/// Table and plots in one page, the plots drawn in `scratch`, an existing folder.
[[nodiscard]] std::string format_page(const HardBench& bench, const std::filesystem::path& scratch);

}  // namespace app
