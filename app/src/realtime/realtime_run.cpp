#include "realtime/realtime_run.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "play/note_of_strike.h"
#include "play/play_setup.h"
#include "process/clock.h"

namespace app {
namespace {

constexpr double kRenderReserveS = 0.003, kSoundReserveS = 0.005;
constexpr double kSamplesExpectedHz = 100;
constexpr double kStepS = 0.1;  // between two recorded steps of the leads
constexpr std::int64_t kLongestWaitNs = 20'000'000;
constexpr double kWatchS = 0.05;
constexpr double kGraceS = 0.001, kJitterS = 1e-5;

std::vector<double> trial_of(const FrameThread* frames) {
    std::vector<double> trial = frames ? frames->trial_s() : std::vector<double>{0.0};
    trial.resize(quality_levels().size(), trial.back());
    return trial;
}

}  // namespace

RealtimeRun::RealtimeRun(const Kit& kit, const RealtimeOptions& options, const StickGeometry& stick,
                         double t0_s, std::int64_t period_samples, const RealtimeParts& parts,
                         std::size_t sticks, std::int64_t epoch_ns)
    : kit_(kit),
      options_(options),
      geometry_(stick),
      t0_s_(t0_s),
      period_samples_(period_samples),
      parts_(parts),
      epoch_ns_(epoch_ns),
      samples_seen_(sticks, 0),
      starts_seen_(sticks, 0),
      fps_(options.play.fps),
      quality_(1 / options.play.fps, trial_of(parts.frames)),
      render_lead_(options.play.render_lead_s, options.play.fps, kRenderReserveS),
      sound_lead_(options.play.sound_lead_s, kSamplesExpectedHz,
                  kSoundReserveS + options.play.release_margin_s),
      seen_(sticks) {
    for (std::uint32_t i = 0; i < sticks; ++i) sticks_.emplace_back(i, stick, options.play.sound_lead_s);
    for (const QualityLevel& level : quality_levels()) result_.quality_levels.push_back(level.name);
    result_.period_s = static_cast<double>(period_samples) / audio::kSampleRate;
    result_.output_lead_s = options.output_lead_s;
    result_.release_margin_s = options.play.release_margin_s;
    begin_lap(0);
}

std::int64_t RealtimeRun::now_ns() const {
    return monotonic_ns() - epoch_ns_;
}

double RealtimeRun::lap_time_s(std::int64_t run_ns, std::uint64_t lap) const {
    const double lap_start_s = static_cast<double>(lap) * result_.period_s;
    return t0_s_ + (to_s(run_ns) - lap_start_s);
}

/// The earliest onset on the lap's clock that the sound can still place: a block beyond the one it is at.
double RealtimeRun::fixed_s(std::uint64_t lap) const {
    if (!parts_.sound) return -std::numeric_limits<double>::infinity();
    const std::int64_t sample = parts_.sound->fixed_sample() + parts_.sound->block_size() -
                                static_cast<std::int64_t>(lap) * period_samples_;
    return t0_s_ + static_cast<double>(sample) / audio::kSampleRate;
}

void RealtimeRun::begin_lap(std::uint64_t lap) {
    if (pipeline_) {
        pipeline_->finish();
        laps_.push_back({lap_, pipeline_->strikes(), first_id_});
        first_id_ += pipeline_->strikes().size();
    }
    lap_ = lap;
    newest_s_ = -std::numeric_limits<double>::infinity();
    for (Stick& stick : sticks_) stick.forget();
    pipeline_ = std::make_unique<StrikePipeline>(
        kit_, strike_rules(options_.play, t0_s_), geometry_.radius_m, sticks_, parts_.simulation,
        [this](const Strike& strike, bool scheduled) { send(strike, scheduled); });
}

void RealtimeRun::send(const Strike& strike, bool scheduled) {
    if (!parts_.sound) return;
    if (!scheduled) {
        (void)parts_.sound->cancel(first_id_ + strike.id);
        return;
    }
    audio::Note note = note_of(strike, kit_.instruments[strike.instrument]);
    note.id += first_id_;
    note.onset_sample += static_cast<std::int64_t>(lap_) * period_samples_;
    (void)parts_.sound->schedule(note);
}

void RealtimeRun::wait(std::int64_t until_ns) {
    const std::int64_t left = std::clamp<std::int64_t>(until_ns - now_ns(), 0, kLongestWaitNs);
    pollfd wake{parts_.sensors.wake_fd(), POLLIN, 0};
    const timespec timeout{0, left};
    if (ppoll(&wake, 1, &timeout, nullptr) > 0) parts_.sensors.clear_wake();
}

/// A live stream may say where the tip is (`# tip_m:`), in the lines before its first row.
void RealtimeRun::learn_geometry() {
    const StreamHead head = parts_.sensors.stream_head();
    if (head.text == stream_head_) return;
    stream_head_ = head.text;
    tracking::Trace keys;
    keys.tip = head.tip;
    keys.shaft = head.shaft;
    geometry_ = stick_geometry(keys, kit_.stick, options_.play.tip, options_.play.shaft);
    for (Stick& stick : sticks_) stick.set_geometry(geometry_);
    parts_.stage.set_stick(geometry_);
}

void RealtimeRun::take_states() {
    struct New {
        std::uint32_t stick;
        tracking::StickState state;
    };
    std::vector<New> fresh;
    const std::int64_t taken_ns = now_ns();
    std::int64_t query_ns = 0;
    for (std::uint32_t i = 0; i < sticks_.size(); ++i) {
        const std::int64_t start = monotonic_ns();
        const std::optional<tracking::StickState> state = parts_.sensors.newest(i);
        query_ns = std::max(query_ns, monotonic_ns() - start);
        if (!state || state->samples == samples_seen_[i]) continue;
        if (state->t_s < t0_s_)
            samples_seen_[i] = state->samples;  // live, before the epoch: not part of the run
        else
            fresh.push_back({i, *state});
    }
    if (is_live(options_) && !fresh.empty()) learn_geometry();  // the head comes before the first state
    // Not stable_sort, whose buffer is not aligned for what holds Eigen's types.
    std::ranges::sort(fresh, {}, [](const New& n) { return std::tuple(n.state.lap, n.state.t_s, n.stick); });
    for (std::size_t i = 0; i < fresh.size();) {
        // A stick that is still in the lap before has nothing to say any more.
        if (fresh[i].state.lap < lap_) {
            samples_seen_[fresh[i].stick] = fresh[i].state.samples;
            ++i;
            continue;
        }
        if (fresh[i].state.lap > lap_) begin_lap(fresh[i].state.lap);
        std::vector<std::uint32_t> moved;
        const double t_s = fresh[i].state.t_s;
        for (; i < fresh.size() && fresh[i].state.lap == lap_ && fresh[i].state.t_s == t_s; ++i) {
            sticks_[fresh[i].stick].take(fresh[i].state);
            moved.push_back(fresh[i].stick);
        }
        std::ranges::sort(moved);
        take(moved, taken_ns, query_ns);
    }
}

void RealtimeRun::take(const std::vector<std::uint32_t>& moved, std::int64_t taken_ns,
                       std::int64_t query_ns) {
    const double s = sticks_[moved.front()].state().t_s;
    newest_s_ = std::max(newest_s_, s);
    any_sample_ = true;
    const double fixed = fixed_s(lap_);
    pipeline_->advance_to(newest_s_, fixed);
    std::vector<std::uint64_t> skipped;
    for (const std::uint32_t stick : moved) {
        const tracking::StickState& state = sticks_[stick].state();
        skipped.push_back(state.samples - samples_seen_[stick] - 1);
        samples_seen_[stick] = state.samples;
        if (state.starts != starts_seen_[stick]) pipeline_->restart(stick);
        starts_seen_[stick] = state.starts;
        sticks_[stick].set_sound_lead(sound_lead_s());
        seen_[stick].push_back(
            {s + static_cast<double>(lap_) * result_.period_s, state.position, state.orientation, true});
    }
    const double simulated = pipeline_->times().simulation;
    pipeline_->take(s, moved);
    const std::int64_t handed_ns = now_ns();
    const auto contact_ns = taken_ns + to_ns(pipeline_->times().simulation - simulated);
    for (std::size_t i = 0; i < moved.size(); ++i) {
        record_sample(moved[i], skipped[i], taken_ns, query_ns);
        SampleTiming& timing = result_.samples.back();
        timing.contact_ns = contact_ns;
        timing.handed_ns = handed_ns;
        timing.late_s = fixed - (s + options_.play.release_margin_s);
        (void)sound_lead_.measured(to_s(handed_ns - timing.due_ns));
    }
}

void RealtimeRun::record_sample(std::uint32_t stick, std::uint64_t skipped, std::int64_t taken_ns,
                                std::int64_t query_ns) {
    const tracking::StickState& state = sticks_[stick].state();
    SampleTiming timing;
    timing.stick = stick;
    timing.lap = lap_;
    timing.t_s = state.t_s;
    timing.due_ns = state.due_ns - epoch_ns_;
    timing.read_ns = state.read_ns - epoch_ns_;
    timing.filtered_ns = state.filtered_ns - epoch_ns_;
    timing.taken_ns = taken_ns;
    timing.query_ns = query_ns;
    timing.skipped = skipped;
    result_.samples.push_back(timing);
}

double RealtimeRun::next_frame_at_s() const {
    const double begin_s = static_cast<double>(next_frame_) / fps_ - render_lead_s();
    const double begin_lap_s = lap_time_s(to_ns(begin_s), lap_);
    const bool expected = std::ranges::any_of(sticks_, [&](const Stick& stick) {
        const double due_s = stick.state().t_s + stick.interval_s();
        return stick.started() && due_s <= begin_lap_s + kJitterS && due_s > begin_lap_s - stick.interval_s();
    });
    return expected ? begin_s + kGraceS : begin_s;
}

void RealtimeRun::ask_for_frames() {
    for (;; ++next_frame_) {
        const double shown_s = static_cast<double>(next_frame_) / fps_;
        if (shown_s >= end_s_ || now_ns() < to_ns(next_frame_at_s())) return;
        ask_for_frame(next_frame_);
    }
}

void RealtimeRun::ask_for_frame(std::uint64_t index) {
    FrameTiming timing;
    timing.index = index;
    const double shown_s = static_cast<double>(index) / fps_;
    timing.shown_ns = to_ns(shown_s);
    timing.lead_s = render_lead_s();
    timing.quality = static_cast<int>(quality_.level());
    timing.fate = FrameFate::skipped;
    const std::int64_t start = now_ns();
    timing.started_ns = start;
    timing.asked_for = quality_.wants(index);
    if (!timing.asked_for || start >= timing.shown_ns) {
        result_.frames.push_back(timing);
        if (timing.asked_for) skipped(shown_s);
        return;
    }
    const double T = lap_time_s(timing.shown_ns, lap_);
    std::vector<std::optional<tracking::PosePrediction>> poses(sticks_.size());
    std::vector<sim::ModalState> bodies;
    if (any_sample_ && std::isfinite(newest_s_)) {
        FrameContents scene = pipeline_->scene(newest_s_, T);
        for (std::size_t i = 0; i < poses.size(); ++i)
            if (scene.sticks[i]) poses[i] = scene.sticks[i]->pose;
        record_tips(scene, index, T);
        bodies = std::move(scene.bodies);
        double oldest_s = newest_s_;
        for (const Stick& stick : sticks_)
            if (stick.started()) oldest_s = std::min(oldest_s, stick.state().t_s);
        timing.oldest_sample_age_s = T - oldest_s;
    }
    FrameJob job{index, quality_.level(), epoch_ns_ + timing.shown_ns,
                 options_.disturbance.slower_at(to_s(start)), parts_.stage.frame(bodies, poses)};
    timing.query_ns = now_ns() - start;
    result_.frames.push_back(timing);
    if (parts_.frames->push(std::move(job)))
        drawing_quality_ = timing.quality;
    else
        skipped(shown_s);
}

void RealtimeRun::skipped(double shown_s) {
    // One that waits for a frame of another level says nothing of this one.
    if (static_cast<std::size_t>(drawing_quality_) != quality_.level()) return;
    if (const auto why = quality_.frame(shown_s, false, -1)) note_step(*why);
}

void RealtimeRun::record_tips(const FrameContents& scene, std::uint64_t index, double T) {
    for (std::uint32_t i = 0; i < sticks_.size(); ++i) {
        if (!scene.sticks[i]) continue;
        const DrawnStick& stick = *scene.sticks[i];
        result_.tips.push_back({index, i, lap_, T, false, stick.held, stick.tip.position, stick.tip.velocity,
                                tracking::point_of(stick.pose, geometry_.tip).position});
    }
}

/// Enters what the drawing thread measured of a frame.
FrameTiming& RealtimeRun::settle(const DrawnFrame& drawn) {
    FrameTiming& frame = *std::ranges::lower_bound(result_.frames, drawn.index, {}, &FrameTiming::index);
    frame.fate = drawn.in_time ? FrameFate::in_time : FrameFate::late;
    frame.started_ns = drawn.started_ns - epoch_ns_;
    frame.drawn_ns = drawn.drawn_ns - epoch_ns_;
    frame.read_ns = drawn.read_ns - epoch_ns_;
    for (DrawnTip& tip : std::ranges::equal_range(result_.tips, drawn.index, {}, &DrawnTip::frame))
        tip.shown = drawn.in_time;
    return frame;
}

void RealtimeRun::finish_frames() {
    parts_.frames->finish();
    for (const DrawnFrame& drawn : parts_.frames->take_done()) settle(drawn);
    for (const auto& [index, written_ns] : parts_.frames->written())
        std::ranges::lower_bound(result_.frames, index, {}, &FrameTiming::index)->written_ns =
            written_ns - epoch_ns_;
    result_.frames_not_written = parts_.frames->not_written();
}

void RealtimeRun::take_frames() {
    if (!parts_.frames) return;
    for (const DrawnFrame& drawn : parts_.frames->take_done()) {
        const FrameTiming& done = settle(drawn);
        const double query_start_s = to_s(done.started_ns - done.query_ns);
        const double delay_s = to_s(done.read_ns) - query_start_s;
        const double shown_s = to_s(done.shown_ns);
        if (static_cast<std::size_t>(done.quality) != quality_.level()) continue;
        if (render_lead_.measured(delay_s) > options_.play.render_lead_s && options_.lead_auto)
            if (const auto why = quality_.outgrown(shown_s)) note_step(*why);
        if (static_cast<std::size_t>(done.quality) != quality_.level()) continue;
        if (const auto why = quality_.frame(shown_s, drawn.in_time, to_s(done.read_ns - done.started_ns)))
            note_step(*why);
    }
}

LeadStep RealtimeRun::step_now() const {
    LeadStep step;
    step.at_s = to_s(now_ns());
    step.render_lead_s = render_lead_s();
    step.sound_lead_s = sound_lead_s();
    step.render_delay_s = render_lead_.delay_s();
    step.sound_delay_s = sound_lead_.delay_s();
    step.quality = static_cast<int>(quality_.level());
    step.fps = fps_ / quality_levels()[quality_.level()].rate_divisor;
    return step;
}

void RealtimeRun::note_step(const std::string& why) {
    render_lead_.forget();
    result_.leads.push_back(step_now());
    result_.leads.back().why = why;
}

void RealtimeRun::follow_delays() {
    const double at_s = to_s(now_ns());
    if (at_s - last_step_s_ < kStepS) return;
    last_step_s_ = at_s;
    if (parts_.sound) {
        const audio::BlockCount blocks = parts_.sound->block_count();
        const std::size_t late = blocks.late - late_blocks_seen_, all = blocks.all - blocks_seen_;
        blocks_seen_ = blocks.all, late_blocks_seen_ = blocks.late;
        if (parts_.frames)
            if (const auto why = quality_.blocks(at_s, all, late)) note_step(*why);
    }
    result_.leads.push_back(step_now());
}

void RealtimeRun::take_notes() {
    if (!parts_.sound) return;
    for (const audio::PlayedNote& played : parts_.sound->take_played()) {
        NoteTiming note;
        note.played = played;
        note.late_s = static_cast<double>(played.onset_sample - played.planned_sample) / audio::kSampleRate;
        result_.notes.push_back(note);
    }
}

std::uint64_t RealtimeRun::refused() const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < sticks_.size(); ++i)
        if (const auto state = parts_.sensors.newest(i)) sum += state->refused;
    return sum;
}

void RealtimeRun::run(double seconds, const std::function<bool()>& stop,
                      const std::function<void(const std::string&)>& warn,
                      const std::function<void(double)>& progress) {
    end_s_ = seconds;
    double watched_s = 0;
    for (;;) {
        const double now_s = to_s(now_ns());
        if (now_s >= end_s_ || stop() || (parts_.sensors.ended() && now_s > 0)) break;
        double next_s = end_s_;
        if (parts_.frames) next_s = std::min(next_s, next_frame_at_s());
        wait(to_ns(next_s));
        take_states();
        if (parts_.frames) ask_for_frames();
        take_frames();
        take_notes();
        follow_delays();
        if (now_s - watched_s < kWatchS) continue;
        watched_s = now_s;
        for (SensorEvent& event : parts_.sensors.watch()) {
            warn(event.message);
            result_.events.push_back(std::move(event));
        }
        progress(now_s / end_s_);
    }
    take_states();
    end_s_ = std::min(end_s_, to_s(now_ns()));
    begin_lap(lap_ + 1);  // what is pending is played
    result_.seconds = end_s_;
    result_.laps = lap_;  // also those that no sample came from
}

}  // namespace app
