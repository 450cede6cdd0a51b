#include "latency/latency_report.h"

#include <algorithm>
#include <cmath>

#include "process/clock.h"
#include "statistics/statistics.h"

namespace app {
namespace {

using Kind = LatencyStage::Kind;

double ms(std::int64_t ns) {
    return 1e-6 * static_cast<double>(ns);
}

/// Adds a stage with the value of each item for which value(item) is one.
template <class Items, class Value>
void add(LatencyReport& report, Kind kind, const char* name, const char* meaning, const Items& items,
         const Value& value) {
    std::vector<double> values;
    for (const auto& item : items)
        if (const std::optional<double> one = value(item)) values.push_back(*one);
    if (!values.empty()) report.stages.push_back({name, meaning, kind, Spread(std::move(values))});
}

using MaybeMs = std::optional<double>;

void add_sample_stages(LatencyReport& report, const std::vector<SampleTiming>& samples) {
    const auto stage = [&](const char* name, const char* meaning, auto from, auto to) {
        add(report, Kind::sound, name, meaning, samples,
            [&](const SampleTiming& s) { return MaybeMs(ms(s.*to - s.*from)); });
    };
    using S = SampleTiming;
    stage("sensor to filter", "sample due to filters done", &S::due_ns, &S::filtered_ns);
    stage("filter to app", "filters done to the application having it", &S::filtered_ns, &S::taken_ns);
    add(report, Kind::sound, "query", "of the shared memory", samples,
        [](const S& s) { return MaybeMs(ms(s.query_ns)); });
    stage("contact", "the application having it to the simulation's answer", &S::taken_ns, &S::contact_ns);
    stage("note hand-over", "the simulation's answer to notes with the audio", &S::contact_ns, &S::handed_ns);
    stage("sample to notes", "sample due to notes with the audio", &S::due_ns, &S::handed_ns);
}

void add_frame_stages(LatencyReport& report, const std::vector<FrameTiming>& frames) {
    using F = FrameTiming;
    const auto stage = [&](const char* name, const char* meaning, auto value) {
        add(report, Kind::picture, name, meaning, frames, [&](const F& f) {
            return f.fate == FrameFate::skipped || f.read_ns == 0 ? MaybeMs() : value(f);
        });
    };
    stage("frame query", "poses and simulation asked", [](const F& f) { return MaybeMs(ms(f.query_ns)); });
    stage("frame drawn", "drawing", [](const F& f) { return MaybeMs(ms(f.drawn_ns - f.started_ns)); });
    stage("frame read back", "drawn to pixels there",
          [](const F& f) { return MaybeMs(ms(f.read_ns - f.drawn_ns)); });
    stage("frame in all", "query begun to pixels there",
          [](const F& f) { return MaybeMs(ms(f.read_ns - f.started_ns + f.query_ns)); });
    stage("frame written", "pixels there to file written",
          [](const F& f) { return f.written_ns > 0 ? MaybeMs(ms(f.written_ns - f.read_ns)) : MaybeMs(); });
}

void add_ages(LatencyReport& report, const RealtimeResult& realtime) {
    add(report, Kind::age, "pose age in frames", "shown minus its oldest stick's sample", realtime.frames,
        [](const FrameTiming& f) {
            return f.fate == FrameFate::in_time ? MaybeMs(1e3 * f.oldest_sample_age_s) : MaybeMs();
        });
    add(report, Kind::age, "pose age in notes", "onset minus the newest sample that could change it",
        realtime.notes, [](const NoteTiming& n) { return MaybeMs(1e3 * n.pose_age_s); });
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
    report.sound_minus_picture_ms = Spread(std::move(touches));
    report.sound_minus_frame_ms = Spread(std::move(frames));
}

void add_needed_leads(LatencyReport& report, double output_lead_s) {
    const LatencyStage *frame = find_stage(report, "frame in all"),
                       *notes = find_stage(report, "sample to notes"),
                       *block = find_stage(report, "block computed");
    if (frame != nullptr) report.render_lead_needed_ms = frame->ms.percentile(99);
    if (notes != nullptr)
        report.sound_lead_needed_ms = notes->ms.percentile(99) + 1e3 * output_lead_s +
                                      (block != nullptr ? block->ms.percentile(99) : 0);
}

}  // namespace

Spread::Spread(std::vector<double> values) : sorted_(std::move(values)) {
    std::sort(sorted_.begin(), sorted_.end());
}

double Spread::percentile(double percent) const {
    return quantile_of_sorted(sorted_, percent / 100);
}

double LatencyReport::share_within_atsc() const {
    const auto matched = static_cast<double>(sound_minus_picture_ms.count());
    const double all = matched + static_cast<double>(notes_without_picture);
    return all == 0 ? 0
                    : sound_minus_picture_ms.share_within(kAtscLimits.early_ms, kAtscLimits.late_ms) *
                          matched / all;
}

double LatencyReport::share_within_itu() const {
    return sound_minus_picture_ms.share_within(kItuLimits.early_ms, kItuLimits.late_ms);
}

double Spread::share_within(double low, double high) const {
    if (sorted_.empty()) return 0;
    const auto inside = std::upper_bound(sorted_.begin(), sorted_.end(), high) -
                        std::lower_bound(sorted_.begin(), sorted_.end(), low);
    return static_cast<double>(inside) / static_cast<double>(sorted_.size());
}

LatencyReport latency_report(const PlayResult& play, const RealtimeResult& realtime, const Kit& kit,
                             double tip_radius_m) {
    LatencyReport report;
    add_sample_stages(report, realtime.samples);
    add(report, Kind::sound, "block computed", "planned to done", realtime.blocks,
        [](const audio::BlockTiming& b) { return MaybeMs(ms(b.done_ns - b.planned_ns)); });
    add_frame_stages(report, realtime.frames);
    add_ages(report, realtime);
    add_deadlines(report, play, realtime);
    add_sound_and_picture(report, play, realtime, kit, tip_radius_m);
    report.errors = drawn_errors(realtime, play.tracks, play.t0_s);
    if (!report.errors.empty()) report.rms_error_mm = rms_mm(report.errors, 0, 1e300);
    add_needed_leads(report, realtime.output_lead_s);
    return report;
}

const LatencyStage* find_stage(const LatencyReport& report, std::string_view name) {
    const auto stage = std::find_if(report.stages.begin(), report.stages.end(),
                                    [&](const LatencyStage& s) { return s.name == name; });
    return stage == report.stages.end() ? nullptr : &*stage;
}

}  // namespace app
