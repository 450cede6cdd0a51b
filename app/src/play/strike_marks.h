#pragma once
#include <tracking/trace.h>

#include <span>
#include <vector>

#include "pictures/annotations.h"
#include "strikes/strike.h"

namespace app {

/// A mark stays for this long: from the onset of a note that sounded, or from its cancellation.
inline constexpr double kMarkS = 0.25;
/// A note that begins later than this after its contact is late; less is rounding and the sample grid.
inline constexpr double kLateMarkS = 0.001;

/// The marks of the picture shown at T, of the strikes as known then; newest first.
[[nodiscard]] std::vector<StrikeMark> strike_marks(std::span<const Strike> strikes, double T);

/// Where a recorded stick is at T: straight between two samples, turned evenly; none before the first and after the
/// last.
[[nodiscard]] std::optional<tracking::PosePrediction> recorded_pose(const tracking::StickTrace& stick,
                                                                    double T);

}  // namespace app
