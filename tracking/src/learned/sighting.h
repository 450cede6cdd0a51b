#pragma once
#include <cstdint>

#include "tracking/sensor.h"

namespace tracking {

/// One augmentation of a recorded stick for training: the sensor that samples it, and a scaling of its motion
/// in time and space. A few recordings so give many different examples.
struct Sighting {
    SensorModel sensor;
    bool orientation = true;  ///< whether the sensor reports it
    double slower = 1;        ///< times are multiplied by this
    /// Ways from the first position by `greater`, those along y by `taller` in addition; then all is turned.
    double greater = 1, taller = 1;
    Eigen::Quaterniond tilt = Eigen::Quaterniond::Identity();

    [[nodiscard]] StickTrace seen(StickTrace stick) const;
};

/// 60 Hz within 3 %, 0.25 mm of noise; without orientation three times out of ten. If not `plain` three out
/// of five are of 30 to 150 Hz, half of these with up to 4 ms of jitter, half with up to 15 % lost; times
/// change by up to exp(0.6), sizes by exp(0.4), heights by exp(0.2), and the vertical turns by 0.15 rad
/// (standard deviation, each axis).
[[nodiscard]] Sighting random_sighting(std::uint64_t seed, bool plain);

}  // namespace tracking
