#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "compare/comparison.h"

namespace app {

/// What repeats a comparison: `experiment.toml`, which every run of `compare` writes.
struct Experiment {
    std::string version;                 ///< of the program that wrote it
    std::string folder;                  ///< that names of files begin in; relative to the experiment's own
    std::vector<std::string> arguments;  ///< of `compare`, without --out and --samples
    std::vector<InputFile> inputs;
};

/// The files that a comparison reads: recordings with what lies beside them, the kit's, models, predictions made
/// elsewhere. Throws BadInput for one that is not there.
[[nodiscard]] std::vector<InputFile> inputs_of(const ComparisonOptions& options);

/// Text of an experiment.toml.
[[nodiscard]] std::string format_experiment(const Experiment& experiment);

/// Throws BadInput with FILE:LINE:COLUMN, also where an input is no longer what it was.
[[nodiscard]] Experiment read_experiment(const std::filesystem::path& file);

}  // namespace app
