#include "compare/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "files/bad_input.h"
#include "files/option_values.h"
#include "kit/tip_track.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace fs = std::filesystem;
namespace {

struct MarkedTime {
    double t_s;
    std::string stick, kind;
};

/// Rows t,stick,WORD,... of a table whose header begins with `header`.
std::vector<MarkedTime> read_marks(const fs::path& file, const std::string& header) {
    std::ifstream in(file);
    std::vector<MarkedTime> marks;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (number == 1 && !line.starts_with(header))
            throw BadInput(
                fmt::format("{}:1:1: error: found \"{}\", expected the columns {}; mend it or move it away",
                            file.string(), line.substr(0, 60), header));
        if (number == 1 || line.empty()) continue;
        const std::vector<std::string> fields = split(line);
        double t_s = 0;
        const char* end = fields[0].data() + fields[0].size();
        const auto [stop, error] = std::from_chars(fields[0].data(), end, t_s);
        if (fields.size() < 2 || error != std::errc{} || stop != end || !std::isfinite(t_s))
            throw BadInput(
                fmt::format("{}:{}:1: error: found \"{}\", expected a time in seconds and a stick; mend it "
                            "or move the file away",
                            file.string(), number, line.substr(0, 60)));
        marks.push_back({t_s, fields[1], fields.size() > 2 ? fields[2] : ""});
    }
    return marks;
}

/// TRACE.csv -> TRACE.WORD.csv
fs::path beside(const std::string& trace, const std::string& word) {
    fs::path file = trace;
    return file.replace_extension(word + ".csv");
}

bool is_of(const MarkedTime& mark, const std::string& stick) {
    return mark.stick == stick || mark.stick == "both";
}

void add_hits(Recording& recording, const fs::path& file) {
    for (const MarkedTime& mark : read_marks(file, "t,stick"))
        for (std::size_t i = 0; i < recording.marks.size(); ++i)
            if (is_of(mark, recording.trace.sticks[i].name)) recording.marks[i].impacts_s.push_back(mark.t_s);
}

void add_flags(Recording& recording, const fs::path& file) {
    for (const MarkedTime& mark : read_marks(file, "t,stick,kind"))
        for (std::size_t i = 0; i < recording.marks.size(); ++i)
            if (is_of(mark, recording.trace.sticks[i].name))
                (mark.kind.starts_with("orientation") ? recording.marks[i].flagged_rotations_s
                                                      : recording.marks[i].flagged_s)
                    .push_back(mark.t_s);
}

void add_lows(Recording& recording) {
    const std::vector<TipTrack> tracks = tip_tracks(recording.trace, recording.geometry);
    for (std::size_t i = 0; i < tracks.size(); ++i)
        for (const Low& low : find_lows(tracks[i])) recording.marks[i].impacts_s.push_back(low.t_s);
}

/// "p3", "player2", "subject01", "s1": a word that numbers people.
bool numbers_people(const std::string& word) {
    const std::size_t digits = word.find_first_of("0123456789");
    if (digits == std::string::npos || word.find_first_not_of("0123456789", digits) != std::string::npos)
        return false;
    const std::string letters = word.substr(0, digits);
    return letters == "p" || letters == "s" || letters == "player" || letters == "person" ||
           letters == "subject";
}

std::string person_of(const std::string& file,
                      const std::vector<std::pair<std::string, std::string>>& persons) {
    for (const auto& [text, name] : persons)
        if (file.find(text) != std::string::npos) return name;
    std::error_code error;
    const fs::path whole = fs::absolute(file, error).lexically_normal();
    const std::string folder = whole.parent_path().filename().string();
    const std::string stem = whole.stem().string();
    const std::string word = stem.substr(0, stem.find_first_of("_-. "));
    return numbers_people(word) ? folder + "/" + word : folder;
}

Recording empty_recording(tracking::Trace trace, std::string person) {
    Recording recording;
    recording.file = trace.file;
    recording.person = std::move(person);
    recording.trace = std::move(trace);
    recording.geometry = stick_geometry(recording.trace, {}, {}, {});
    recording.marks.resize(recording.trace.sticks.size());
    return recording;
}

void sort_marks(Recording& recording) {
    for (MarkedTimes& marks : recording.marks)
        for (std::vector<double>* times : {&marks.impacts_s, &marks.flagged_s, &marks.flagged_rotations_s})
            std::sort(times->begin(), times->end());
}

}  // namespace

Recording read_recording(const std::string& file,
                         const std::vector<std::pair<std::string, std::string>>& persons) {
    Recording recording = empty_recording(tracking::read_trace(file), person_of(file, persons));
    recording.file = file;
    std::error_code error;
    if (const fs::path hits = beside(file, ".hits"); fs::exists(hits, error))
        add_hits(recording, hits);
    else
        add_lows(recording);
    if (const fs::path flags = beside(file, ".flags"); fs::exists(flags, error)) add_flags(recording, flags);
    sort_marks(recording);
    return recording;
}

Recording recording_of(tracking::Trace trace, std::string person) {
    Recording recording = empty_recording(std::move(trace), std::move(person));
    add_lows(recording);
    sort_marks(recording);
    return recording;
}

bool same_samples(const Recording& a, const Recording& b) {
    const auto same_pose = [](const tracking::PoseSample& x, const tracking::PoseSample& y) {
        return x.t_s == y.t_s && x.position == y.position && x.has_orientation == y.has_orientation &&
               (!x.has_orientation || x.orientation.coeffs() == y.orientation.coeffs());
    };
    return std::equal(a.trace.sticks.begin(), a.trace.sticks.end(), b.trace.sticks.begin(),
                      b.trace.sticks.end(),
                      [&](const tracking::StickTrace& x, const tracking::StickTrace& y) {
                          return std::equal(x.samples.begin(), x.samples.end(), y.samples.begin(),
                                            y.samples.end(), same_pose);
                      });
}

void require_distinct(std::span<const Recording> recordings) {
    for (std::size_t i = 0; i < recordings.size(); ++i)
        for (std::size_t before = 0; before < i; ++before)
            if (same_samples(recordings[i], recordings[before]))
                throw BadInput(
                    fmt::format("{}: error: found the samples of {} again, expected every recording once; "
                                "leave one of them out",
                                recordings[i].file, recordings[before].file));
}

}  // namespace app
