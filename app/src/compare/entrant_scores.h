#pragma once
#include <vector>

#include "compare/entrants.h"

namespace app {

/// Runs every entrant over every stick of the field at every lead: errors and calibration; strikes, if there
/// is a surface, those of an entrant that learns an advance with the one that it learned (on `tuning`, of
/// --tune, or, if that is empty, on all others of the field; never on the one that is scored); cost, if asked
/// for. By stick, entrant, lead, but where an entrant does not take part. The rows do not depend on
/// `options.threads`.
[[nodiscard]] std::vector<ComparisonRow> score_entrants(const Field& field, const Field& tuning,
                                                        const std::vector<Entrant>& entrants,
                                                        const ComparisonOptions& options);

}  // namespace app
