#pragma once
#include <tracking/training.h>

#include <span>
#include <string>
#include <vector>

#include "compare/recording.h"

namespace app {

/// What a network learns from, and what it is validated by.
struct TrainingField {
    std::vector<tracking::TrainingStick> sticks;
    std::string held_out;  ///< one sentence
};

/// Of five recordings or more every fifth, counted from the fifth, is held out; of fewer, the last fifth of each in
/// time. What flags mark is not learned from. Throws BadInput where the recordings are too short for that.
[[nodiscard]] TrainingField training_field(std::span<const Recording> recordings);

/// Where a model comes from: the program's version, the command, the recordings with their SHA-256, whether they
/// are synthetic, and the errors on what was held out.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> provenance_of(
    std::span<const Recording> recordings, const TrainingField& field,
    const tracking::TrainingOptions& options, const tracking::TrainingResult& result,
    const std::string& version);

/// The errors as a table.
[[nodiscard]] std::string format_training_text(const tracking::TrainingResult& result,
                                               const TrainingField& field);

}  // namespace app
