#pragma once
#include <tracking/sensor.h>

#include <string>

namespace app {

/// What the sensor reports of every stick of a trace, in the order of arrival (tracking::sense); keys as in the
/// trace, except `rate_hz`, which becomes the sensor's where it has one. Throws tracking::TraceError for more
/// samples than can be, BadInput for a stick of which fewer than two samples are left.
[[nodiscard]] tracking::Trace seen_by(const tracking::Trace& trace, const tracking::SensorModel& sensor);

/// What a sensor does to a trace, in words, for a trace's source; empty for one that does nothing.
[[nodiscard]] std::string describe(const tracking::SensorModel& sensor);

}  // namespace app
