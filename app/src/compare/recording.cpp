#include "compare/recording.h"

#include <fmt/format.h>
#include <tracking/input.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <regex>
#include <sstream>

#include "files/bad_input.h"
#include "files/option_values.h"
#include "statistics/statistics.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kNearS = 0.050;

/// Adds the rows t,stick,KIND,... of a table whose header begins with `header` to the times that `times_of` a
/// kind names.
template <class TimesOf>
void add_marks(Recording& recording, const fs::path& file, const std::string& header,
               const TimesOf& times_of) {
    std::istringstream in(tracking::read_bytes(file.string(), "marks that belong to a trace"));
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (number == 1 && !line.starts_with(header))
            throw BadInput(
                fmt::format("{}:1:1: error: found \"{}\", expected the columns {}; mend it or move it away",
                            file.string(), tracking::printable(line.substr(0, 60)), header));
        if (number == 1 || line.empty()) continue;
        const std::vector<std::string> fields = split(line);
        double t_s = 0;
        const char* end = fields[0].data() + fields[0].size();
        const auto [stop, failed] = std::from_chars(fields[0].data(), end, t_s);
        if (fields.size() < 2 || failed != std::errc{} || stop != end || !std::isfinite(t_s))
            throw BadInput(
                fmt::format("{}:{}:1: error: found \"{}\", expected a time in seconds and a stick; mend it "
                            "or move the file away",
                            file.string(), number, tracking::printable(line.substr(0, 60))));
        const auto times = times_of(fields.size() > 2 ? fields[2] : "");
        for (std::size_t i = 0; i < recording.marks.size(); ++i)
            if (fields[1] == recording.trace.sticks[i].name || fields[1] == "both")
                (recording.marks[i].*times).push_back(t_s);
    }
    for (MarkedTimes& marks : recording.marks)
        for (std::vector<double>* times : {&marks.impacts_s, &marks.flagged_s, &marks.flagged_rotations_s})
            std::ranges::sort(*times);
}

double median_rate(const std::vector<tracking::PoseSample>& samples) {
    std::vector<double> dt;
    for (std::size_t i = 1; i < samples.size(); ++i) dt.push_back(samples[i].t_s - samples[i - 1].t_s);
    return dt.empty() ? 0 : 1 / median(std::move(dt));
}

std::optional<Truth> truth_at(const Recording& recording, std::size_t stick, double sample_s, double lead_s) {
    const std::optional<tracking::PoseSample> pose =
        tracking::pose_at(recording.trace.sticks[stick], sample_s + lead_s);
    if (!pose) return std::nullopt;
    const MarkedTimes& marks = recording.marks[stick];
    const auto flagged = [&](const std::vector<double>& times) {
        return near_any(times, sample_s) || near_any(times, sample_s + lead_s);
    };
    Truth truth;
    truth.pose = *pose;
    truth.unflagged = !flagged(marks.flagged_s);
    truth.free = truth.unflagged && !near_any(marks.impacts_s, sample_s + lead_s);
    truth.rotation_trusted = pose->has_orientation && !flagged(marks.flagged_rotations_s);
    return truth;
}

}  // namespace

std::string person_of(const std::string& file, const PersonNames& persons) {
    for (const auto& [text, name] : persons)
        if (file.find(text) != std::string::npos) return name;
    std::error_code error;
    const fs::path whole = fs::absolute(file, error).lexically_normal();
    const std::string folder = whole.parent_path().filename().string(), stem = whole.stem().string();
    const std::string word = stem.substr(0, stem.find_first_of("_-. "));
    static const std::regex kNumbersPeople("(p|s|player|person|subject)[0-9]+");
    return std::regex_match(word, kNumbersPeople) ? folder + "/" + word : folder;
}

Recording recording_of(tracking::Trace trace, std::string person) {
    Recording recording{std::move(trace), std::move(person), {}, {}, {}};
    recording.geometry = stick_geometry(recording.trace, {}, {}, {});
    recording.tracks = tip_tracks(recording.trace, recording.geometry);
    for (const TipTrack& track : recording.tracks) {
        MarkedTimes& marks = recording.marks.emplace_back();
        for (const Low& low : find_lows(track)) marks.impacts_s.push_back(low.t_s);
    }
    return recording;
}

Recording read_recording(const std::string& file, const PersonNames& persons) {
    Recording recording = recording_of(tracking::read_trace(file), person_of(file, persons));
    const auto beside = [&](const char* extension) { return fs::path(file).replace_extension(extension); };
    // What is there but cannot be read is an error.
    const auto is_there = [](const fs::path& marks) {
        std::error_code error;
        return fs::symlink_status(marks, error).type() != fs::file_type::not_found;
    };
    if (const fs::path hits = beside(".hits.csv"); is_there(hits)) {
        for (MarkedTimes& marks : recording.marks) marks.impacts_s.clear();
        add_marks(recording, hits, "t,stick", [](const std::string&) { return &MarkedTimes::impacts_s; });
    }
    if (const fs::path flags = beside(".flags.csv"); is_there(flags))
        add_marks(recording, flags, "t,stick,kind", [](const std::string& kind) {
            return kind.starts_with("orientation") ? &MarkedTimes::flagged_rotations_s
                                                   : &MarkedTimes::flagged_s;
        });
    return recording;
}

bool same_samples(const Recording& a, const Recording& b) {
    const auto same_pose = [](const tracking::PoseSample& x, const tracking::PoseSample& y) {
        return x.t_s == y.t_s && x.position == y.position && x.has_orientation == y.has_orientation &&
               (!x.has_orientation || x.orientation.coeffs() == y.orientation.coeffs());
    };
    return std::ranges::equal(a.trace.sticks, b.trace.sticks,
                              [&](const tracking::StickTrace& x, const tracking::StickTrace& y) {
                                  return std::ranges::equal(x.samples, y.samples, same_pose);
                              });
}

void require_distinct(std::span<const Recording> recordings) {
    for (std::size_t i = 0; i < recordings.size(); ++i)
        for (std::size_t before = 0; before < i; ++before)
            if (same_samples(recordings[i], recordings[before]))
                throw BadInput(
                    fmt::format("{}: error: found the samples of {} again, expected each recording once; "
                                "leave one of them out",
                                recordings[i].trace.file, recordings[before].trace.file));
}

bool near_any(const std::vector<double>& times, double t_s) {
    const auto next = std::ranges::lower_bound(times, t_s - kNearS);
    return next != times.end() && *next <= t_s + kNearS;
}

SensedStick sense_stick(const Recording& recording, std::size_t stick, const tracking::SensorModel& sensor,
                        std::span<const double> leads_s) {
    SensedStick sensed;
    const tracking::StickTrace& recorded = recording.trace.sticks[stick];
    sensed.stick = stick;
    sensed.name = recorded.name;
    sensed.tip = recording.geometry.tip;
    sensed.shaft = recording.geometry.shaft;
    sensed.samples = tracking::sense(recording.trace, stick, sensor);
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
            SensedStick stick = sense_stick(recordings[r], s, sensor, leads_s);
            stick.recording = r;
            stick.number = sticks.size();
            sticks.push_back(std::move(stick));
        }
    return sticks;
}

Field read_field(const std::vector<std::string>& files, const PersonNames& persons,
                 const tracking::SensorModel& sensor, std::span<const double> leads_s) {
    Field field;
    for (const std::string& file : files) field.recordings.push_back(read_recording(file, persons));
    require_distinct(field.recordings);
    field.sticks = sense_all(field.recordings, sensor, leads_s);
    return field;
}

}  // namespace app
