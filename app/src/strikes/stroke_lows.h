#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "kit/kit.h"

namespace app {

/// Where a stick's tip turned from falling to rising: a height minimum with a prominence of at least 25 mm.
struct Low {
    double t_s = 0;
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();      ///< [m], world
    double descent_mps = 0;                             ///< fastest fall on the way down
    double fastest_s = 0;                               ///< when
    Eigen::Vector3d fastest = Eigen::Vector3d::Zero();  ///< the tip there
    double turning_s = 0;  ///< descent_mps over the upward acceleration at the low (across +-9 ms): how long
                           ///< that acceleration takes to stop the fall. About 10 ms on a head, 20-100 ms
                           ///< where an arm swings through.
};

/// The lows of one tip, by time. Nothing is joined across a gap of more than tracking::kGapS.
[[nodiscard]] std::vector<Low> find_lows(const TipTrack& track);

inline constexpr double kNearLowestM = 0.05;  ///< lows this close to the lowest belong to one surface

/// Height at which a surface stops the tips: the median of the lows within 50 mm of the lowest. `lows` is not
/// empty.
[[nodiscard]] double contact_height(std::span<const Low> lows);

}  // namespace app
