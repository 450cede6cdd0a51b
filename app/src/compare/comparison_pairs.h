#pragma once
#include <vector>

#include "compare/comparison.h"
#include "compare/entrants.h"

namespace app {

/// Every estimator at every lead against the best baseline (PairedResult), on the recordings that the
/// estimator answers. Rows and summaries are those of the comparison.
[[nodiscard]] std::vector<PairedResult> pair_with_baselines(const Comparison& comparison,
                                                            const std::vector<Entrant>& entrants);

/// What the winners' intervals do not say: among how many they were picked.
[[nodiscard]] std::string selection_caution(const Comparison& comparison);

}  // namespace app
