#include "latency/latency_report.h"

#include <fmt/format.h>
#include <sim/hermite_piece.h>
#include <sim/modal_body.h>
#include <tracking/predictor.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "kit/surface_entry.h"
#include "process/clock.h"
#include "report/json_document.h"

namespace app {
namespace {

constexpr double kLongestPieceS = 0.25, kTouchToleranceS = 1e-11;

/// The tips of one stick that were shown during one lap, by time.
using DrawnPath = std::vector<DrawnTip>;

std::map<std::pair<std::uint32_t, std::uint64_t>, DrawnPath> drawn_paths(const RealtimeResult& realtime) {
    std::map<std::pair<std::uint32_t, std::uint64_t>, DrawnPath> paths;  // by stick and lap
    for (const DrawnTip& tip : realtime.tips) {
        DrawnPath& path = paths[{tip.stick, tip.lap}];
        if (tip.shown && (path.empty() || tip.t_s > path.back().t_s)) path.push_back(tip);
    }
    return paths;
}

/// When the path comes into the surface, `distance` 0 or less, next to a note's onset.
template <class Distance>
std::optional<double> nearest_touch(const DrawnPath& path, double onset_s, const Distance& distance) {
    const double from_s = onset_s - kPictureWindowS, to_s = onset_s + kPictureWindowS;
    std::optional<double> nearest;
    auto b = std::ranges::lower_bound(path, from_s, {}, &DrawnTip::t_s);
    if (b == path.begin() && b != path.end()) ++b;
    for (; b != path.end() && (b - 1)->t_s <= to_s; ++b) {
        const DrawnTip& a = *(b - 1);
        if (b->t_s - a.t_s > kLongestPieceS) continue;
        const sim::HermitePiece piece({a.t_s, a.tip, a.velocity}, {b->t_s, b->tip, b->velocity});
        const auto distance_at = [&](double t_s) { return distance(piece.position(t_s)); };
        walk(a.t_s, b->t_s, distance(a.tip), piece.greatest_speed(), distance_at, [&](const WalkStep& step) {
            if (!step.enters()) return;
            const double t_s = entry_between(step.from, step.to, kTouchToleranceS, distance_at);
            const bool nearer = !nearest || std::abs(t_s - onset_s) < std::abs(*nearest - onset_s);
            if (nearer && t_s >= from_s && t_s <= to_s) nearest = t_s;
        });
    }
    return nearest;
}

std::uint64_t lap_at(double at_s, double period_s) {
    return period_s > 0 ? static_cast<std::uint64_t>(std::max(0.0, std::floor(at_s / period_s))) : 0;
}

std::optional<Eigen::Vector3d> truth_at(const TipTrack& track, double t_s) {
    const auto after = std::upper_bound(track.t_s.begin(), track.t_s.end(), t_s);
    if (after == track.t_s.begin() || after == track.t_s.end()) return std::nullopt;
    const auto b = static_cast<std::size_t>(after - track.t_s.begin()), a = b - 1;
    const double dt = track.t_s[b] - track.t_s[a];
    if (dt > tracking::kGapS) return std::nullopt;
    return track.tip[a] + (t_s - track.t_s[a]) / dt * (track.tip[b] - track.tip[a]);
}

using Json = nlohmann::ordered_json;
using Kind = LatencyStage::Kind;

constexpr const char* kFates[] = {"in time", "late", "skipped"};  // by FrameFate
static_assert(std::size(kFates) == static_cast<std::size_t>(FrameFate::skipped) + 1);

double ms(std::int64_t ns) {
    return 1e-6 * static_cast<double>(ns);
}

/// The stages that something took, with the value of each item but for those of which it is kNoValue.
std::vector<LatencyStage> stages_of(const RealtimeResult& realtime) {
    using S = SampleTiming;
    using F = FrameTiming;
    std::vector<LatencyStage> stages;
    const auto add = [&](Kind kind, const char* name, const char* meaning, const auto& items, auto value) {
        std::vector<double> values;
        for (const auto& item : items)
            if (const double one = value(item); !std::isnan(one)) values.push_back(one);
        if (!values.empty()) stages.push_back({name, meaning, kind, Spread(std::move(values))});
    };
    const auto sample = [&](const char* name, const char* meaning, auto from, auto to) {
        add(Kind::sound, name, meaning, realtime.samples, [&](const S& s) { return ms(s.*to - s.*from); });
    };
    const auto frame = [&](const char* name, const char* meaning, auto value) {
        add(Kind::picture, name, meaning, realtime.frames,
            [&](const F& f) { return f.fate == FrameFate::skipped || f.read_ns == 0 ? kNoValue : value(f); });
    };
    sample("sensor to filter", "sample due to filters done", &S::due_ns, &S::filtered_ns);
    sample("filter to app", "filters done to the application having it", &S::filtered_ns, &S::taken_ns);
    add(Kind::sound, "query", "of the shared memory", realtime.samples,
        [](const S& s) { return ms(s.query_ns); });
    sample("contact", "the application having it to the simulation's answer", &S::taken_ns, &S::contact_ns);
    sample("note hand-over", "the simulation's answer to notes with the audio", &S::contact_ns,
           &S::handed_ns);
    sample("sample to notes", "sample due to notes with the audio", &S::due_ns, &S::handed_ns);
    add(Kind::sound, "block computed", "planned to done", realtime.blocks,
        [](const audio::BlockTiming& b) { return ms(b.done_ns - b.planned_ns); });
    frame("frame query", "poses and simulation asked", [](const F& f) { return ms(f.query_ns); });
    frame("frame drawn", "drawing", [](const F& f) { return ms(f.drawn_ns - f.started_ns); });
    frame("frame read back", "drawn to pixels there", [](const F& f) { return ms(f.read_ns - f.drawn_ns); });
    frame("frame in all", "query begun to pixels there",
          [](const F& f) { return ms(f.read_ns - f.started_ns + f.query_ns); });
    frame("frame written", "pixels there to file written",
          [](const F& f) { return f.written_ns > 0 ? ms(f.written_ns - f.read_ns) : kNoValue; });
    add(Kind::age, "pose age in frames", "shown minus its oldest stick's sample", realtime.frames,
        [](const F& f) { return f.fate == FrameFate::in_time ? 1e3 * f.oldest_sample_age_s : kNoValue; });
    add(Kind::age, "pose age in notes", "onset minus the newest sample that could change it", realtime.notes,
        [](const NoteTiming& n) { return 1e3 * n.pose_age_s; });
    return stages;
}

template <class Items, class Missed>
Deadline deadline(const char* name, const char* meaning, const Items& items, const Missed& missed) {
    const auto count = std::count_if(items.begin(), items.end(), missed);
    return {name, meaning, items.size(), static_cast<std::size_t>(count)};
}

void add_deadlines(LatencyReport& report, const PlayResult& play, const RealtimeResult& realtime) {
    constexpr double kHalfASampleS = 0.5 / audio::kSampleRate;
    report.samples = deadline("samples", "taken before what they may change is fixed", realtime.samples,
                              [](const SampleTiming& s) { return s.late_s > 0; });
    std::size_t skipped = 0;
    for (const SampleTiming& sample : realtime.samples) skipped += sample.skipped;
    report.skipped = {"samples seen", "by the application, before the next one came",
                      realtime.samples.size() + skipped, skipped};
    report.notes = deadline("notes", "sounded when they were planned", realtime.notes,
                            [](const NoteTiming& n) { return n.late_s > kHalfASampleS; });
    report.strokes = {"strokes", "sounded, by a note within 30 ms",
                      static_cast<std::size_t>(play.score.true_contacts),
                      static_cast<std::size_t>(play.score.missed)};
    const auto output_lead_ns = to_ns(realtime.output_lead_s);
    report.blocks =
        deadline("blocks", "of sound, done before they are due", realtime.blocks,
                 [&](const audio::BlockTiming& b) { return b.done_ns - b.planned_ns > output_lead_ns; });
    for (const FrameTiming& frame : realtime.frames) {
        report.frames_left_out += !frame.asked_for;
        report.frames_late += frame.asked_for && frame.fate == FrameFate::late;
        report.frames_skipped += frame.asked_for && frame.fate == FrameFate::skipped;
    }
    report.frames = {"frames", "there before they are shown", realtime.frames.size() - report.frames_left_out,
                     report.frames_late + report.frames_skipped};
}

void add_sound_and_picture(LatencyReport& report, const PlayResult& play, const RealtimeResult& realtime,
                           const Kit& kit, double tip_radius_m) {
    report.pictures = sound_and_picture(play, realtime, kit, tip_radius_m);
    report.notes_without_picture = realtime.notes.size() - report.pictures.size();
    std::vector<double> touches, frames;
    for (const SoundPicture& picture : report.pictures) {
        touches.push_back(picture.sound_minus_picture_ms());
        if (const auto frame = picture.sound_minus_frame_ms()) frames.push_back(*frame);
    }
    report.sound_minus_picture_ms = Spread(touches);
    report.sound_minus_frame_ms = Spread(frames);
}

void add_needed_leads(LatencyReport& report, double output_lead_s) {
    const auto p99 = [&](const char* name) -> std::optional<double> {
        const LatencyStage* stage = find_stage(report, name);
        return stage == nullptr ? std::nullopt : std::optional(stage->ms.percentile(99));
    };
    report.render_lead_needed_ms = p99("frame in all");
    if (const std::optional<double> notes = p99("sample to notes"))
        report.sound_lead_needed_ms = *notes + 1e3 * output_lead_s + p99("block computed").value_or(0);
}

Table sample_table(const PlayResult& play, const RealtimeResult& realtime) {
    Table table = Table::of({"stick", "lap", "t_s", "due_ns", "read_ns", "filtered_ns", "taken_ns",
                             "query_ns", "contact_ns", "handed_ns", "skipped", "late_s"});
    for (const SampleTiming& s : realtime.samples)
        table.add({play.sticks.at(s.stick), s.lap, s.t_s, s.due_ns, s.read_ns, s.filtered_ns, s.taken_ns,
                   s.query_ns, s.contact_ns, s.handed_ns, s.skipped, s.late_s});
    return table;
}

Table frame_table(const RealtimeResult& realtime) {
    Table table = Table::of({"index", "fate", "asked_for", "lead_s", "quality", "pose_age_s", "shown_ns",
                             "query_ns", "started_ns", "drawn_ns", "read_ns", "written_ns"});
    for (const FrameTiming& f : realtime.frames)
        table.add({f.index, kFates[static_cast<std::size_t>(f.fate)], f.asked_for, f.lead_s, f.quality,
                   f.oldest_sample_age_s, f.shown_ns, f.query_ns, f.started_ns, f.drawn_ns, f.read_ns,
                   f.written_ns});
    return table;
}

Table note_table(const LatencyReport& report, const PlayResult& play, const RealtimeResult& realtime) {
    Table table = Table::of({"id", "stick", "instrument", "lap", "onset_s", "late_s", "pose_age_s",
                             "planned_sample", "onset_sample", "taken_ns", "midi_sent_ns", "touch_s",
                             "sound_minus_picture_ms", "sound_minus_frame_ms"});
    auto picture = report.pictures.begin();
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& n = realtime.notes[i];
        const Strike& strike = play.strikes.at(n.strike);
        Cells row = {strike.id,
                     play.sticks.at(strike.stick),
                     play.instruments.at(strike.instrument),
                     n.lap,
                     onset_in_lap_s(n, play.t0_s, realtime.period_s),
                     n.late_s,
                     n.pose_age_s,
                     n.played.planned_sample,
                     n.played.onset_sample,
                     n.played.taken_ns,
                     n.played.midi_sent_ns};
        if (picture != report.pictures.end() && picture->note == i) {
            row.insert(row.end(), {picture->touch_s, picture->sound_minus_picture_ms(),
                                   picture->sound_minus_frame_ms()});
            ++picture;
        }
        row.resize(table.columns.size());
        table.add(std::move(row));
    }
    return table;
}

Table block_table(const RealtimeResult& realtime) {
    Table table = Table::of({"planned_ns", "started_ns", "done_ns"});
    for (const audio::BlockTiming& b : realtime.blocks) table.add({b.planned_ns, b.started_ns, b.done_ns});
    return table;
}

Table lead_table(const RealtimeResult& realtime) {
    Table table = Table::of({"at_s", "render_lead_s", "sound_lead_s", "render_delay_s", "sound_delay_s",
                             "quality", "fps", "why"});
    for (const LeadStep& l : realtime.leads)
        table.add({l.at_s, l.render_lead_s, l.sound_lead_s, l.render_delay_s, l.sound_delay_s, l.quality,
                   l.fps, realtime.why(l)});
    return table;
}

Table error_table(const LatencyReport& report, const PlayResult& play) {
    Table table = Table::of({"at_s", "stick", "error_mm"});
    for (const DrawnError& e : report.errors) table.add({e.at_s, play.sticks.at(e.stick), 1e3 * e.error_m});
    return table;
}

Json events_of(const RealtimeResult& realtime) {
    Json events = Json::array();
    for (const SensorEvent& event : realtime.events)
        events.push_back({{"at_s", event.at_s}, {"sticks", event.sticks}, {"message", event.message}});
    return events;
}

Json frames_of(const LatencyReport& report, const RealtimeResult& realtime) {
    return {{"total", report.frames.total},       {"missed", report.frames.missed},
            {"late", report.frames_late},         {"skipped", report.frames_skipped},
            {"left_out", report.frames_left_out}, {"not_written", realtime.frames_not_written}};
}

/// RMS errors of the drawn sticks in all and second by second.
Json errors_of(const LatencyReport& report) {
    Json windows = Json::array();
    const double end_s = report.errors.empty() ? -1 : report.errors.back().at_s;
    for (int second = 0; second <= end_s; ++second)
        windows.push_back({{"from_s", second}, {"rms", rms_mm(report.errors, second, second + 1)}});
    return {{"count", report.errors.size()}, {"rms", Cell(report.rms_error_mm).json()}, {"seconds", windows}};
}

Json run_of(const PlayResult& play, const RealtimeResult& realtime) {
    Json priorities = Json::object();
    for (const auto& [thread, obtained] : realtime.priorities) priorities[thread] = obtained;
    return {{"trace", play.trace},
            {"kit", play.options.kit.string()},
            {"picture_predictor", play.options.picture_predictor},
            {"sound_predictor", play.options.sound_predictor},
            {"seconds", realtime.seconds},
            {"period_s", realtime.period_s},
            {"laps", realtime.laps},
            {"fps", play.options.fps},
            {"output_lead_s", realtime.output_lead_s},
            {"release_margin_s", play.options.release_margin_s},
            {"disturbed_by", realtime.disturbed_by},
            {"audio_device", realtime.audio_device},
            {"device_delay_ms", 1e3 * realtime.device_delay_s},
            {"priorities", priorities},
            {"quality_levels", realtime.quality_levels},
            {"refused_changes", realtime.refused_changes},
            {"queue_overflows", realtime.queue_overflows},
            {"device_underruns", realtime.device_underruns}};
}

}  // namespace

double onset_in_lap_s(const NoteTiming& note, double t0_s, double period_s) {
    return t0_s + static_cast<double>(note.played.onset_sample) / audio::kSampleRate -
           static_cast<double>(note.lap) * period_s;
}

std::vector<SoundPicture> sound_and_picture(const PlayResult& play, const RealtimeResult& realtime,
                                            const Kit& kit, double tip_radius_m) {
    auto paths = drawn_paths(realtime);
    std::vector<SoundPicture> matched;
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& note = realtime.notes[i];
        const Strike& strike = play.strikes[note.strike];
        const DrawnPath& path = paths[{strike.stick, note.lap}];
        const auto distance = [&](const Eigen::Vector3d& tip) {
            return sim::rest_distance(kit.instruments[strike.instrument].body, tip, tip_radius_m).distance;
        };
        const double onset_s = onset_in_lap_s(note, play.t0_s, realtime.period_s);
        const std::optional<double> touch_s = nearest_touch(path, onset_s, distance);
        if (!touch_s) continue;
        matched.push_back({i, onset_s, *touch_s, std::nullopt});
        const auto behind =
            std::find_if(std::ranges::lower_bound(path, *touch_s, {}, &DrawnTip::t_s), path.end(),
                         [&](const DrawnTip& tip) { return tip.held || distance(tip.tip) <= 0; });
        if (behind != path.end() && behind->t_s <= *touch_s + kPictureWindowS)
            matched.back().frame_s = behind->t_s;
    }
    return matched;
}

std::vector<DrawnError> drawn_errors(const RealtimeResult& realtime, std::span<const TipTrack> tracks,
                                     double t0_s) {
    std::vector<DrawnError> errors;
    std::vector<const DrawnTip*> screen(tracks.size(), nullptr);
    auto tip = realtime.tips.begin();
    for (const FrameTiming& frame : realtime.frames) {
        for (; tip != realtime.tips.end() && tip->frame <= frame.index; ++tip)
            if (tip->shown && tip->stick < screen.size()) screen[tip->stick] = &*tip;
        if (!frame.asked_for) continue;
        const double at_s = 1e-9 * static_cast<double>(frame.shown_ns);
        const std::uint64_t lap = lap_at(at_s, realtime.period_s);
        for (std::uint32_t stick = 0; stick < screen.size(); ++stick) {
            if (screen[stick] == nullptr || screen[stick]->lap != lap) continue;
            if (const auto truth = truth_at(tracks[stick], t0_s + at_s))
                errors.push_back({at_s, stick, (screen[stick]->drawn - *truth).norm()});
        }
    }
    return errors;
}

double rms_mm(std::span<const DrawnError> errors, double from_s, double to_s) {
    const auto begin = std::ranges::lower_bound(errors, from_s, {}, &DrawnError::at_s),
               end = std::ranges::lower_bound(errors, to_s, {}, &DrawnError::at_s);
    double sum = 0;
    for (auto error = begin; error < end; ++error) sum += error->error_m * error->error_m;
    return begin < end ? 1e3 * std::sqrt(sum / static_cast<double>(end - begin)) : 0;
}

double Spread::share_within(double low, double high) const {
    if (sorted_.empty()) return 0;
    const auto inside = std::ranges::upper_bound(sorted_, high) - std::ranges::lower_bound(sorted_, low);
    return static_cast<double>(inside) / static_cast<double>(sorted_.size());
}

std::optional<double> LatencyReport::share_within(const AvLimits& limits) const {
    if (pictures.empty()) return std::nullopt;
    return sound_minus_picture_ms.share_within(limits.early_ms, limits.late_ms);
}

std::string milliseconds(const std::optional<double>& value) {
    return value ? fmt::format("{:.1f} ms", *value) : "unknown";
}

LatencyReport latency_report(const PlayResult& play, const RealtimeResult& realtime, const Kit& kit,
                             double tip_radius_m) {
    LatencyReport report;
    report.stages = stages_of(realtime);
    add_deadlines(report, play, realtime);
    add_sound_and_picture(report, play, realtime, kit, tip_radius_m);
    report.errors = drawn_errors(realtime, play.tracks, play.t0_s);
    if (!report.errors.empty()) report.rms_error_mm = rms_mm(report.errors, 0, 1e300);
    add_needed_leads(report, realtime.output_lead_s);
    return report;
}

const LatencyStage* find_stage(const LatencyReport& report, std::string_view name) {
    const auto stage = std::ranges::find(report.stages, name, &LatencyStage::name);
    return stage == report.stages.end() ? nullptr : &*stage;
}

Table stage_table(const LatencyReport& report) {
    Table table =
        Table::of({"name", "meaning", "count:d", "p50_ms:.3f", "p95_ms:.3f", "p99_ms:.3f", "max_ms:.3f"});
    for (const LatencyStage& s : report.stages)
        table.add({s.name, s.meaning, s.ms.count(), s.ms.percentile(50), s.ms.percentile(95),
                   s.ms.percentile(99), s.ms.percentile(100)});
    return table;
}

Table deadline_table(const LatencyReport& report) {
    Table table = Table::of({"name", "meaning", "total:d", "met:d", "missed:d"});
    for (const Deadline* d : report.deadlines())
        table.add({d->name, d->meaning, d->total, d->total - d->missed, d->missed});
    return table;
}

Table spread_table(const LatencyReport& report) {
    Table table = Table::of({"sound minus", "p5:+.1f:ms", "median:+.1f:ms", "p95:+.1f:ms", "min:+.1f:ms",
                             "max:+.1f:ms", "count:d"});
    const auto add = [&](const char* name, const Spread& ms) {
        table.add({name, ms.percentile(5), ms.percentile(50), ms.percentile(95), ms.percentile(0),
                   ms.percentile(100), ms.count()});
    };
    add("picture", report.sound_minus_picture_ms);
    add("first frame", report.sound_minus_frame_ms);
    return table;
}

Table clock_table(const PlayResult& play, const RealtimeResult& realtime) {
    Table table = Table::of({"stick", "clock", "offset_s:.6f", "drift_ppm:.1f", "delay_p95_ms:.2f", "jumps:d",
                             "ahead_of_wall_s:.3f"});
    for (std::size_t i = 0; i < realtime.clocks.size() && i < play.sticks.size(); ++i) {
        const ClockReport& c = realtime.clocks[i];
        table.add({play.sticks[i], name_of(c.clock), c.estimate.offset_s, c.estimate.drift_ppm,
                   c.estimate.delay_p95_s * 1e3, c.estimate.jumps, c.wall ? Cell(c.ahead_s) : Cell()});
    }
    return table;
}

std::vector<std::pair<const char*, std::function<Table()>>> latency_rows(const LatencyReport& report,
                                                                         const PlayResult& play,
                                                                         const RealtimeResult& realtime) {
    return {{"samples.csv", [&] { return sample_table(play, realtime); }},
            {"frames.csv", [&] { return frame_table(realtime); }},
            {"notes.csv", [&] { return note_table(report, play, realtime); }},
            {"blocks.csv", [&] { return block_table(realtime); }},
            {"leads.csv", [&] { return lead_table(realtime); }},
            {"errors.csv", [&] { return error_table(report, play); }}};
}

std::string format_latency_text(const LatencyReport& report, const RealtimeResult& realtime) {
    std::string text = fmt::format("{:.1f} s, {} lap{}, {}\n\n", realtime.seconds, realtime.laps,
                                   realtime.laps == 1 ? "" : "s", realtime.audio_device);
    text += stage_table(report).text() + '\n' + deadline_table(report).text();
    if (report.frames_left_out > 0)
        text += fmt::format("left out because the frame rate was lowered: {} more frames\n",
                            report.frames_left_out);
    text += fmt::format("\n{}", spread_table(report).text());
    if (const auto atsc = report.share_within(kAtscLimits), itu = report.share_within(kItuLimits);
        atsc && itu)
        text += fmt::format(
            "of the notes with a picture, within ATSC's {:g} to {:+g} ms: {:.1f} %, within ITU-R BT.1359's "
            "{:g} to {:+g} ms: {:.1f} %\n",
            kAtscLimits.early_ms, kAtscLimits.late_ms, 100 * *atsc, kItuLimits.early_ms, kItuLimits.late_ms,
            100 * *itu);
    text += fmt::format("notes whose drawn stick does not strike: {}\n", report.notes_without_picture);
    text += fmt::format("\nleads needed: pictures {}, sound {}\n", milliseconds(report.render_lead_needed_ms),
                        milliseconds(report.sound_lead_needed_ms));
    if (report.rms_error_mm)
        text += fmt::format("drawn sticks, RMS error on the screen: {:.1f} mm\n", *report.rms_error_mm);
    return text;
}

std::string format_latency_json(const LatencyReport& report, const PlayResult& play,
                                const RealtimeResult& realtime) {
    Json spreads = spread_table(report).json();
    for (Json& spread : spreads) spread.erase("sound minus");
    Json& picture = spreads[0];
    picture["unmatched"] = report.notes_without_picture;
    picture["share_within_atsc"] = Cell(report.share_within(kAtscLimits)).json();
    picture["share_within_itu"] = Cell(report.share_within(kItuLimits)).json();
    const Json json = {{"run", run_of(play, realtime)},
                       {"stages", stage_table(report).json()},
                       {"frames", frames_of(report, realtime)},
                       {"notes", {{"total", report.notes.total}, {"late", report.notes.missed}}},
                       {"samples",
                        {{"taken", report.samples.total},
                         {"late", report.samples.missed},
                         {"skipped", report.skipped.missed}}},
                       {"strokes", {{"total", report.strokes.total}, {"missed", report.strokes.missed}}},
                       {"deadlines", deadline_table(report).json()},
                       {"sound_minus_picture_ms", picture},
                       {"sound_minus_frame_ms", spreads[1]},
                       {"lead_needed_ms",
                        {{"render", Cell(report.render_lead_needed_ms).json()},
                         {"sound", Cell(report.sound_lead_needed_ms).json()}}},
                       {"drawn_error_mm", errors_of(report)},
                       {"leads", lead_table(realtime).json()},
                       {"clocks", clock_table(play, realtime).json()},
                       {"events", events_of(realtime)}};
    return json_document(json);
}

}  // namespace app
