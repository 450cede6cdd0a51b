#pragma once
#include <tracking/drummer.h>

#include <cstdint>
#include <string>
#include <vector>

#include "kit/kit.h"

namespace app {

/// A piece for two sticks, "left" and "right", on a kit.
struct DrumScore {
    std::vector<tracking::Stroke> strokes;
    double duration_s = 10;
};

/// The scores that make_score knows:
///   flourish  a groove, fills over the whole kit, both sticks on the crash at the end
///   feints    every other stroke, on average, is a feint; 12 of 20 turn 35 ms or more before the contact
///             that they feint, the others close to the head
///   roll      single strokes at 6 to 8 Hz per hand, then 15 Hz from two hands, then 15 Hz from one
[[nodiscard]] const std::vector<std::string>& score_names();

/// The score on a kit. Targets lie on the instruments' surfaces at rest, grown by the tip's radius. Parts are
/// written for the bundled drums and find their instruments by name; on a kit without one of that name its
/// instruments take the parts in turn. Throws BadInput for an unknown name.
[[nodiscard]] DrumScore make_score(const std::string& name, const Kit& kit);

/// The sensor that a synthetic trace is seen with.
struct SyntheticSensor {
    double rate_hz = 120;
    double noise_mm = 0.25;  ///< standard deviation of position noise, each axis; orientation noise goes with
                             ///< it (4 mrad/mm)
    std::uint64_t seed = 1;
};

/// A trace of a score, played by tracking's synthetic drummer with the kit's stick. Positions are rounded to
/// 1 um and quaternions to 1e-6, so that the text does not depend on the last bit of the maths library. Its
/// source says that it is synthetic. Throws BadInput, and std::invalid_argument where the strokes cannot be
/// played on this kit.
[[nodiscard]] tracking::Trace synthesise_score(const std::string& name, const Kit& kit,
                                               const SyntheticSensor& sensor);

}  // namespace app
