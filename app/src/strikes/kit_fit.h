#pragma once
#include <tracking/trace.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "kit/kit.h"

namespace app {

/// An instrument placed where strokes end.
struct FittedInstrument {
    bool struck = false;  ///< true: a real head stopped the sticks there; false: they pass through the place
    double contact_height_m = 0;                    ///< of the tip's centre on the real head, where struck
    Eigen::Vector3d met = Eigen::Vector3d::Zero();  ///< middle of the surface that the tip's centre meets
                                                    ///< (head and tip's radius)
    double radius_m = 0.15;                         ///< of the body
    int lows = 0;                                   ///< in the cluster
    int strokes = 0;                                ///< those that the surface is fitted to
    int entering = 0;                               ///< of these, that go at least 3 mm below `met`
};

struct KitFit {
    std::vector<FittedInstrument> instruments;  ///< from left to right as the player sees them
    Eigen::Vector3d towards_player = Eigen::Vector3d::UnitZ();  ///< unit, horizontal, from the instruments
};

/// Places flat, round instruments where the traces' sticks strike. Lows of all sticks (without those of a stick that
/// swings back: with the tip 0.1 m and more above the tracked point, or falling fastest 50 mm and more behind it) are
/// clustered in the horizontal plane by mean shift (flat kernel, 0.2 m); clusters nearer than 0.2 m are one, clusters of
/// fewer than three lows are dropped unless there are no others. At most 16 instruments are made.
///   struck     at least 15 % of a cluster's lows (and three) lie within 50 mm of its lowest, their
///              inter-quartile range is at most 30 mm and the median of their turning times at most 20 ms.
///              The surface is then 25 mm above contact_height.
///   otherwise  nothing stops the sticks. Of all such strokes those count that fall at least half as fast as the 90th
///              percentile. They are clustered anew, by where they are fastest; clusters of less than a tenth of the
///              largest are dropped. The surface is at the median height of the fastest points, or 50 mm above the 95th
///              percentile of the lows where that is higher; it stands where the strokes pass that height, and is a
///              disc of 30 mm. The kernel is the first of 0.2, 0.3, 0.45 and 0.7 m with which at most a tenth of the
///              strokes passes beside a disc, within 6 ms of its edge: so near that a prediction cannot tell.
/// The surface is what the tip's centre meets: the body's head lies the tip's radius below. Deterministic.
/// O(n) for n samples and at most 1000 m for m lows. Throws BadInput when no stick makes a stroke.
[[nodiscard]] KitFit fit_kit(std::span<const tracking::Trace> traces, const StickGeometry& geometry);

/// "12 strokes were stopped at y = 0.820 m; ..." on one line.
[[nodiscard]] std::string describe(const FittedInstrument& instrument);

/// The fit as a kit file. `kind`: drum, cymbal or bell (a flat bar); `name` of the kit; [stick] tip only
/// where `write_tip`.
[[nodiscard]] std::string format_fitted_kit(const KitFit& fit, const std::string& kind,
                                            const std::string& name, const StickGeometry& geometry,
                                            bool write_tip);

}  // namespace app
