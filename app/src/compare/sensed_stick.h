#pragma once
#include <tracking/sensor.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compare/comparison.h"
#include "compare/recording.h"
#include "statistics/statistics.h"

namespace app {

/// The pose that a prediction is held against, from the noiseless recording.
struct Truth {
    tracking::PoseSample pose;
    bool free = false;              ///< at least 50 ms from impacts, and unflagged
    bool unflagged = false;         ///< neither it nor the sample before it lies within 50 ms of a flag
    bool rotation_trusted = false;  ///< likewise of a flagged orientation
};

/// One stick of a recording as a sensor saw it, with the truth at every lead.
///
/// Protocol: the sensor samples the recording by linear interpolation (tracking::sense); the truth of a
/// prediction made at the sample stamped t is the recording, interpolated likewise, at t + lead. There is no
/// truth for samples of the first 0.5 s, in gaps of the recording and beyond its end, nor for a sample that
/// is not newer than the ones before.
struct SensedStick {
    std::size_t recording = 0;  ///< index of the recording
    std::size_t stick = 0;      ///< index within it
    std::string name;
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    double rate_hz = 0;  ///< the sensor's; the recording's own median if the sensor keeps its times
    std::vector<tracking::PoseSample> samples;  ///< in order of arrival
    std::vector<double> leads_s;
    std::vector<std::optional<Truth>> truths;  ///< samples x leads

    [[nodiscard]] const std::optional<Truth>& truth(std::size_t sample, std::size_t lead) const {
        return truths[sample * leads_s.size() + lead];
    }
};

/// Seconds at the start of a recording that are not scored.
inline constexpr double kSettlingS = 0.5;

/// The samples are those that `musicworld predict` sees of the same file with the same sensor.
/// Throws BadInput for more samples than can be.
[[nodiscard]] SensedStick sense_stick(const Recording& recording, std::size_t stick,
                                      const tracking::SensorModel& sensor, std::span<const double> leads_s);

/// Every stick of every recording, in order.
[[nodiscard]] std::vector<SensedStick> sense_all(std::span<const Recording> recordings,
                                                 const tracking::SensorModel& sensor,
                                                 std::span<const double> leads_s);

/// Whether `t_s` lies within +-50 ms of one of `times` (ascending).
[[nodiscard]] bool near_any(const std::vector<double>& times, double t_s);

/// Recordings and what the sensor sees of them.
struct Field {
    std::vector<Recording> recordings;
    std::vector<SensedStick> sticks;
};

/// Throws tracking::TraceError, and BadInput, also where two files hold the same samples.
[[nodiscard]] Field read_field(const std::vector<std::string>& files, const ComparisonOptions& options);

}  // namespace app
