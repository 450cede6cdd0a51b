#pragma once
#include <memory>
#include <vector>

#include "compare/comparison.h"
#include "compare/entrants.h"

namespace app {

/// `--transfer`: trained on these persons or takes, scored on those. With the recordings that it names, by person or
/// file, among those that tune and not among those that are scored. Throws BadInput for a name that is neither,
/// and where nothing is left to be scored.
[[nodiscard]] ComparisonOptions parted_for_transfer(ComparisonOptions options);

/// The entrants of a network that is trained on `field`: `learned*` alone, and `arbitrated*`, weighed against the
/// filter. Throws BadInput where a recording that is scored is among them, or there is too little to learn
/// from.
[[nodiscard]] std::vector<Entrant> trained_entrants(const ComparisonOptions& options, const Field& scored,
                                                    const Field& field);

}  // namespace app
