#include "compare/sensed_stick.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "files/bad_input.h"
#include "statistics/statistics.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace {

constexpr double kNearS = 0.050;

double median_rate(const std::vector<tracking::PoseSample>& samples) {
    std::vector<double> dt;
    for (std::size_t i = 1; i < samples.size(); ++i) dt.push_back(samples[i].t_s - samples[i - 1].t_s);
    return dt.empty() ? 0 : 1 / quantile(std::move(dt), 0.5);
}

std::optional<Truth> truth_at(const Recording& recording, std::size_t stick, double sample_s, double lead_s) {
    const std::optional<tracking::PoseSample> pose =
        tracking::pose_at(recording.trace.sticks[stick], sample_s + lead_s);
    if (!pose) return std::nullopt;
    const MarkedTimes& marks = recording.marks[stick];
    Truth truth;
    truth.pose = *pose;
    truth.unflagged = !near_any(marks.flagged_s, sample_s) && !near_any(marks.flagged_s, sample_s + lead_s);
    truth.free = truth.unflagged && !near_any(marks.impacts_s, sample_s + lead_s);
    truth.rotation_trusted = pose->has_orientation && !near_any(marks.flagged_rotations_s, sample_s) &&
                             !near_any(marks.flagged_rotations_s, sample_s + lead_s);
    return truth;
}

}  // namespace

bool near_any(const std::vector<double>& times, double t_s) {
    const auto next = std::lower_bound(times.begin(), times.end(), t_s - kNearS);
    return next != times.end() && *next <= t_s + kNearS;
}

SensedStick sense_stick(const Recording& recording, std::size_t stick, const tracking::SensorModel& sensor,
                        std::span<const double> leads_s) {
    SensedStick sensed;
    const tracking::StickTrace& recorded = recording.trace.sticks[stick];
    sensed.stick = stick;
    sensed.name = recorded.name;
    sensed.tip = recording.geometry.tip;
    try {
        sensed.samples = tracking::sense(recorded, sensor, stick);
    } catch (const std::invalid_argument& error) {
        throw BadInput(fmt::format("{}: error: {}", recording.file, error.what()));
    }
    sensed.rate_hz = sensor.rate_hz > 0 ? sensor.rate_hz : median_rate(recorded.samples);
    sensed.leads_s.assign(leads_s.begin(), leads_s.end());
    sensed.truths.reserve(sensed.samples.size() * leads_s.size());
    const double first_s = recorded.samples.front().t_s + kSettlingS;
    double newest_s = -std::numeric_limits<double>::infinity();
    for (const tracking::PoseSample& sample : sensed.samples) {
        const bool scored = sample.t_s > newest_s && sample.t_s >= first_s;
        newest_s = std::max(newest_s, sample.t_s);
        for (const double lead_s : leads_s)
            sensed.truths.push_back(scored ? truth_at(recording, stick, sample.t_s, lead_s) : std::nullopt);
    }
    return sensed;
}

std::vector<SensedStick> sense_all(std::span<const Recording> recordings, const tracking::SensorModel& sensor,
                                   std::span<const double> leads_s) {
    std::vector<SensedStick> sticks;
    for (std::size_t r = 0; r < recordings.size(); ++r)
        for (std::size_t s = 0; s < recordings[r].trace.sticks.size(); ++s) {
            sticks.push_back(sense_stick(recordings[r], s, sensor, leads_s));
            sticks.back().recording = r;
        }
    return sticks;
}

Field read_field(const std::vector<std::string>& files, const ComparisonOptions& options) {
    Field field;
    for (const std::string& file : files) field.recordings.push_back(read_recording(file, options.persons));
    require_distinct(field.recordings);
    if (!files.empty()) field.sticks = sense_all(field.recordings, options.sensor, options.leads_s);
    return field;
}

}  // namespace app
