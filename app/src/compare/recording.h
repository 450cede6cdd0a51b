#pragma once
#include <tracking/sensor.h>

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kit/kit.h"

namespace app {

/// Times of one stick that scoring treats apart [s, the trace's clock], ascending.
struct MarkedTimes {
    std::vector<double> impacts_s;            ///< contacts
    std::vector<double> flagged_s;            ///< positions not to be trusted
    std::vector<double> flagged_rotations_s;  ///< orientations not to be trusted
};

/// A trace with what is known about it.
///
/// Beside TRACE.csv may lie TRACE.hits.csv (columns t,stick,label: impacts) and TRACE.flags.csv (columns
/// t,stick,kind,size: glitches; stick `both` means all; kinds that begin with `orientation` mark
/// orientations, the others positions). Without a hits file the impacts are the lows of the recorded tip
/// (find_lows). The person is named by the folder, followed by the first word of the file's name if that
/// numbers people (p3, player2, subject01); a folder without such names is one person.
struct Recording {
    tracking::Trace trace;
    std::string person;
    StickGeometry geometry;        ///< the trace's own tip and shaft
    std::vector<TipTrack> tracks;  ///< of its tip, a stick each, as the next
    std::vector<MarkedTimes> marks;
};

/// (TEXT, NAME) pairs: the first TEXT that a path contains names its person.
using PersonNames = std::vector<std::pair<std::string, std::string>>;

/// Who plays, as above.
[[nodiscard]] std::string person_of(const std::string& file, const PersonNames& persons);

/// Throws tracking::TraceError and BadInput with the place of the fault.
[[nodiscard]] Recording read_recording(const std::string& file, const PersonNames& persons = {});

/// The same from memory, without files beside it.
[[nodiscard]] Recording recording_of(tracking::Trace trace, std::string person);

/// Whether both hold the same samples, whatever their files and sticks are called.
[[nodiscard]] bool same_samples(const Recording& a, const Recording& b);
/// Throws BadInput where two do.
void require_distinct(std::span<const Recording> recordings);

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
    std::size_t number = 0;     ///< index among the sticks of all recordings
    std::string name;
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();
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
/// Throws tracking::TraceError for more samples than can be.
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
[[nodiscard]] Field read_field(const std::vector<std::string>& files, const PersonNames& persons,
                               const tracking::SensorModel& sensor, std::span<const double> leads_s);

}  // namespace app
