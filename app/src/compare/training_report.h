#pragma once
#include <tracking/training.h>

#include <span>
#include <string>
#include <vector>

#include "compare/recording.h"
#include "compare/training_field.h"

namespace app {

/// Where a model comes from: the program's version, the command, the recordings with their SHA-256, whether
/// they are synthetic, and the errors on what was held out.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> provenance_of(
    std::span<const Recording> recordings, const TrainingField& field,
    const tracking::TrainingOptions& options, const tracking::TrainingResult& result,
    const std::string& version);

/// The errors as a table.
[[nodiscard]] std::string format_training_text(const tracking::TrainingResult& result,
                                               const TrainingField& field);

}  // namespace app
