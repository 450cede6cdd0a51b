#pragma once
#include <vector>

#include "compare/comparison.h"
#include "compare/entrants.h"

namespace app {

/// RMS over leads of 0 to 150 ms of every entrant whose cost is not external, over all recordings; a tuned
/// one runs, at each lead, the parameters chosen for the nearest lead asked for. With a surface also the strikes,
/// at some of these leads and without an advance, of those that tell how far.
[[nodiscard]] std::vector<LeadCurve> lead_curves(const Field& field, const std::vector<Entrant>& entrants,
                                                 const ComparisonOptions& options);

/// The data of figures 3-1 to 3-3 of the thesis, redone on the first stick of the first recording: its 3 s
/// of most motion, and 0.6 s of these. Predicted are naive, thesis and the estimator of least RMS at the
/// middle lead, as far as they take part.
[[nodiscard]] StickFigure stick_figure(const Field& field, const std::vector<Entrant>& entrants,
                                       const Comparison& comparison);

}  // namespace app
