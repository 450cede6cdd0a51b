#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tracking/trace.h"

namespace tracking {

/// Warnings about implausible units, axes or orientation, one line each with the evidence; empty if none.
/// Wrong units, axes and conventions look like this:
///
///   units        no stick ranges over 0.1 m nor moves at 0.5 m/s (both as the 98 % in the middle, and the
///                fastest per cent); or one ranges over more than 3 m, or moves at more than 30 m/s
///   gravity      what stops the tips (the strongest 0.2 % of accelerations, of 1000 at least) comes from one
///                side (the mean of their unit vectors is longer than 0.45) that is more than 60 degrees off
///                from up
///   orientation  wrists turn sticks: motion over 1/30 s is compared with that of a body that turns about a
///                point r fixed in it, dp = -(dR) r, r by least squares. Another reading of the orientation
///                (inverse; mirrored in x, y or z; components in another order; y for z) explains half of the
///                motion and more, and a quarter of the motion more than the one given
///   sides        a stick `left` to the right of one `right` for three quarters of the time and by more than
///                5 cm in the median, seen the way their shafts point while they swing: left-handed data, a
///                mirrored axis, or swapped names. Where the trace says no shaft, it is taken to point away from
///                the point r above, if turning explains half of the motion
///
/// Thresholds: 31 recordings (sabers, mallets, a drumstick) stay clear of them: ranges 0.23 to 1.2 m, fastest
/// per cent 1.9 to 16 m/s, accelerations of sabers, which nothing stops, up to 0.39. Sides are judged only
/// where the shafts point one way while they swing (mean of their horizontal parts, weighted by the square of their turning's speed, above
/// 0.2; in the recordings 0.27 to 0.81).
///
/// Data that are left-handed throughout obey the laws of right-handed ones: `sides` alone tells them apart, so one
/// stick, sticks of other names, and positions alone do not show it.
[[nodiscard]] std::vector<std::string> implausible(const Trace& trace);
/// The line about units alone.
[[nodiscard]] std::optional<std::string> implausible_units(const Trace& trace);

}  // namespace tracking
