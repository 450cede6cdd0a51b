#pragma once
#include <tracking/sensor.h>

#include <string>
#include <vector>

namespace app {

/// What the sensor reports of one stick of a trace, in the order of arrival (see tracking::sense). Throws
/// BadInput for more samples than can be.
[[nodiscard]] std::vector<tracking::PoseSample> seen_samples(const tracking::Trace& trace, std::size_t stick,
                                                             const tracking::SensorModel& sensor);

/// The same of every stick; keys as in the trace, except `rate_hz`, which becomes the sensor's where it has
/// one. Throws BadInput also for a stick of which fewer than two samples are left.
[[nodiscard]] tracking::Trace seen_by(const tracking::Trace& trace, const tracking::SensorModel& sensor);

/// What a sensor does to a trace, in words, for a trace's source; empty for one that does nothing.
[[nodiscard]] std::string describe(const tracking::SensorModel& sensor);

}  // namespace app
