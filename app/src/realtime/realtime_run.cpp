#include "realtime/realtime_run.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "process/progress_bar.h"
#include "process/stop_signals.h"
#include "process/thread_priority.h"

namespace app {
namespace {

constexpr double kRenderReserveS = 0.003, kSoundReserveS = 0.005;
constexpr double kSamplesExpectedHz = 100;
constexpr double kPedalsAheadS = 0.1;  // more than the loop's longest wait and a block's lead
constexpr double kStepS = 0.1;         // between two recorded steps of the leads
constexpr std::int64_t kLongestWaitNs = 20'000'000;
constexpr double kWatchS = 0.05;
constexpr double kGraceS = 0.001, kJitterS = 1e-5;

std::vector<double> trial_of(const FrameThread* frames) {
    std::vector<double> trial = frames ? frames->report().trial_s : std::vector<double>{0.0};
    trial.resize(quality_levels().size(), trial.back());
    return trial;
}

}  // namespace

RealtimeRun::RealtimeRun(RealtimeSession& session)
    : session_(session),
      options_(session.options),
      t0_s_(session.trace.t0_s()),
      pedals_(session.kit, t0_s_),
      samples_seen_(session.trace.sticks.size(), 0),
      starts_seen_(samples_seen_),
      fps_(options_.play.fps),
      quality_(1 / fps_, trial_of(session.frames.get())),
      render_lead_(options_.play.render_lead_s, fps_, kRenderReserveS),
      sound_lead_(options_.play.sound_lead_s, kSamplesExpectedHz,
                  kSoundReserveS + options_.play.release_margin_s) {
    for (std::uint32_t i = 0; i < samples_seen_.size(); ++i) {
        sticks_.emplace_back(i, session.stick, options_.play.sound_lead_s);
        seen_.emplace_back(session.scratch);
    }
    result_.samples = DiskLog<SampleTiming>(session.scratch);
    result_.frames = DiskLog<FrameTiming>(session.scratch);
    result_.tips = DiskLog<DrawnTip>(session.scratch);
    result_.blocks = DiskLog<audio::BlockTiming>(session.scratch);
    result_.notes = DiskLog<NoteTiming>(session.scratch);
    result_.leads = DiskLog<LeadStep>(session.scratch);
    result_.changes = TextLog(session.scratch);
    event_heads_ = DiskLog<EventHead>(session.scratch);
    event_texts_ = TextLog(session.scratch);
    for (const QualityLevel& level : quality_levels()) result_.quality_levels.push_back(level.name);
    result_.period_s = session.period_s();
    result_.output_lead_s = options_.sound.output_lead_s;
    result_.disturbed_by = options_.disturbance.text;
    begin_lap(0);
}

double RealtimeRun::lap_time_s(std::int64_t run_ns) const {
    const double lap_start_s = static_cast<double>(lap_) * result_.period_s;
    return t0_s_ + (to_s(run_ns) - lap_start_s);
}

/// The earliest onset on the lap's clock that the sound can still place: a block beyond the one it is at.
double RealtimeRun::fixed_s() const {
    if (!session_.sound) return -std::numeric_limits<double>::infinity();
    const std::int64_t sample = session_.sound->fixed_sample() + session_.sound->block_size() -
                                static_cast<std::int64_t>(lap_) * session_.period_samples;
    return t0_s_ + static_cast<double>(sample) / audio::kSampleRate;
}

void RealtimeRun::end_lap() {
    pipeline_->finish();
    laps_.push_back({lap_, pipeline_->strikes(), first_id_});
    first_id_ += pipeline_->strikes().size();
}

void RealtimeRun::begin_lap(std::uint64_t lap) {
    if (pipeline_) end_lap();
    lap_ = lap;
    newest_s_ = -std::numeric_limits<double>::infinity();
    for (Stick& stick : sticks_) stick.forget();
    next_move_ = 0;
    // A schedule begins anew; a foot that MIDI tells of stays where it is.
    if (!session_.moves.empty()) pedals_.rest(static_cast<std::int64_t>(lap) * session_.period_samples);
    pipeline_ = std::make_unique<StrikePipeline>(
        session_.kit, pipeline_settings(options_.play, session_.stick, t0_s_), sticks_, *session_.simulation,
        [this](const audio::Note& note, bool scheduled) { send(note, scheduled); }, session_.contacts);
}

void RealtimeRun::send(audio::Note note, bool scheduled) {
    if (!session_.sound) return;
    note.id += first_id_;
    note.onset_sample += static_cast<std::int64_t>(lap_) * session_.period_samples;
    pedals_.put_on(note);
    (void)(scheduled ? session_.sound->schedule(note) : session_.sound->cancel(note.id));
}

/// Moves of the schedule that are due soon, and those that have come by MIDI.
void RealtimeRun::take_pedals() {
    if (!session_.sound) return;
    const std::int64_t earliest = session_.sound->fixed_sample() + session_.sound->block_size();
    const double lap_s = static_cast<double>(lap_) * result_.period_s, now_s = t0_s_ + to_s(now_ns());
    for (; next_move_ < session_.moves.size(); ++next_move_) {
        PedalMove move = session_.moves[next_move_];
        move.t_s += lap_s;
        if (move.t_s > now_s + kPedalsAheadS) break;
        pedals_.take(move, earliest);
    }
    for (audio::MidiMessage message : session_.sound->take_midi()) {
        message.t_s += t0_s_;
        for (const PedalMove& move : moves_of(message, session_.kit)) pedals_.take(move, earliest);
    }
    send_pedals();
}

void RealtimeRun::choke(const TipRest& rest) {
    if (!session_.sound) return;
    const double lap_s = static_cast<double>(lap_) * result_.period_s;
    const auto due = static_cast<std::int64_t>(
        std::ceil((rest.s + options_.play.release_margin_s - t0_s_) * audio::kSampleRate));
    pedals_.take({PedalMove::Kind::tip, rest.s + lap_s, rest.instrument, 0, rest.stick},
                 std::max(due + static_cast<std::int64_t>(lap_) * session_.period_samples,
                          session_.sound->fixed_sample() + session_.sound->block_size()));
    send_pedals();
}

void RealtimeRun::send_pedals() {
    for (; notes_sent_ < pedals_.notes().size(); ++notes_sent_) {
        const PedalNote& sent = pedals_.notes()[notes_sent_];
        (void)session_.sound->schedule(sent.note);
        if (sent.by == PedalMove::Kind::tip) continue;  // the pipeline found it
        audio::Note in_lap = sent.note;
        in_lap.onset_sample -= static_cast<std::int64_t>(lap_) * session_.period_samples;
        pipeline_->choke(in_lap, newest_s_);
    }
    for (; places_sent_ < pedals_.places().size(); ++places_sent_)
        (void)session_.sound->schedule(pedals_.places()[places_sent_]);
}

void RealtimeRun::wait(std::int64_t until_ns) {
    const std::int64_t left = std::clamp<std::int64_t>(until_ns - now_ns(), 0, kLongestWaitNs);
    pollfd wake{session_.sensors->wake_fd(), POLLIN, 0};
    const timespec timeout{0, left};
    if (ppoll(&wake, 1, &timeout, nullptr) > 0) session_.sensors->clear_wake();
}

/// A live stream may say where the tip is (`# tip_m:`), in the lines before its first row.
void RealtimeRun::learn_geometry() {
    const SharedStreamHead head = session_.sensors->stream_head();
    if (head.text.data() == stream_head_) return;
    stream_head_ = head.text.data();
    tracking::Trace keys;
    keys.tip = head.tip;
    keys.shaft = head.shaft;
    session_.stick = stick_geometry(keys, session_.kit.stick, options_.play.tip, options_.play.shaft);
    for (Stick& stick : sticks_) stick.set_geometry(session_.stick);
    session_.stage->set_stick(session_.stick);
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
        const std::optional<tracking::StickState> state = session_.sensors->newest(i);
        query_ns = std::max(query_ns, monotonic_ns() - start);
        if (!state || state->samples == samples_seen_[i]) continue;
        if (state->t_s < t0_s_)
            samples_seen_[i] = state->samples;  // live, before the epoch: not part of the run
        else
            fresh.push_back({i, *state});
    }
    if (session_.live && !fresh.empty()) learn_geometry();  // the head comes before the first state
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
    const double fixed = fixed_s();
    pipeline_->advance_to(newest_s_, fixed);
    for (const std::uint32_t stick : moved) {
        const tracking::StickState& state = sticks_[stick].state();
        if (state.starts != starts_seen_[stick]) pipeline_->restart(stick);
        starts_seen_[stick] = state.starts;
        sticks_[stick].set_sound_lead(sound_lead_s());
        seen_[stick].push_back(
            {s + static_cast<double>(lap_) * result_.period_s, state.position, state.orientation, true});
    }
    const double simulated = pipeline_->times().simulation;
    pipeline_->take(s, moved);
    for (const TipRest& rest : pipeline_->take_tip_rests()) choke(rest);
    const std::int64_t handed_ns = now_ns();
    const double fixed_when_handed = fixed_s();
    const auto contact_ns = taken_ns + to_ns(pipeline_->times().simulation - simulated);
    for (const std::uint32_t stick : moved) {
        const tracking::StickState& state = sticks_[stick].state();
        const std::int64_t due_ns = state.due_ns - session_.epoch_ns;
        result_.samples.push_back({.stick = stick,
                                   .lap = lap_,
                                   .t_s = state.t_s,
                                   .due_ns = due_ns,
                                   .read_ns = state.read_ns - session_.epoch_ns,
                                   .filtered_ns = state.filtered_ns - session_.epoch_ns,
                                   .taken_ns = taken_ns,
                                   .query_ns = query_ns,
                                   .contact_ns = contact_ns,
                                   .handed_ns = handed_ns,
                                   .skipped = state.samples - samples_seen_[stick] - 1,
                                   .late_s = fixed_when_handed - (s + options_.play.release_margin_s)});
        samples_seen_[stick] = state.samples;
        (void)sound_lead_.measured(to_s(handed_ns - due_ns));
    }
}

double RealtimeRun::next_frame_at_s() const {
    const double begin_s = static_cast<double>(next_frame_) / fps_ - render_lead_s();
    const double begin_lap_s = lap_time_s(to_ns(begin_s));
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
    const double T = lap_time_s(timing.shown_ns);
    FrameContents contents;
    if (std::isfinite(newest_s_)) {
        contents = pipeline_->scene(newest_s_, T);
        record_tips(contents, index, T);
        double oldest_s = newest_s_;
        for (const Stick& stick : sticks_)
            if (stick.started()) oldest_s = std::min(oldest_s, stick.state().t_s);
        timing.oldest_sample_age_s = T - oldest_s;
    }
    FrameJob job{index, quality_.level(), session_.epoch_ns + timing.shown_ns,
                 options_.disturbance.slower_at(to_s(start)),
                 session_.stage->frame(contents.bodies, contents.poses(), shown_s)};
    timing.query_ns = now_ns() - start;
    result_.frames.push_back(timing);
    if (session_.frames->push(std::move(job)))
        drawing_quality_ = timing.quality;
    else
        skipped(shown_s);
}

void RealtimeRun::skipped(double shown_s) {
    // One that waits for a frame of another level says nothing of this one.
    if (static_cast<std::size_t>(drawing_quality_) != quality_.level()) return;
    change_quality(quality_.frame(shown_s, false, -1));
}

void RealtimeRun::record_tips(const FrameContents& scene, std::uint64_t index, double T) {
    for (std::uint32_t i = 0; i < sticks_.size(); ++i) {
        if (!scene.sticks[i]) continue;
        const DrawnStick& stick = *scene.sticks[i];
        result_.tips.push_back({index, i, lap_, T, false, stick.held, stick.tip.position, stick.tip.velocity,
                                tracking::point_of(stick.pose, session_.stick.tip).position});
    }
}

FrameTiming& RealtimeRun::frame_of(std::uint64_t index) {
    return *std::ranges::lower_bound(result_.frames, index, {}, &FrameTiming::index);
}

/// Enters what the drawing thread measured of a frame.
FrameTiming& RealtimeRun::settle(const DrawnFrame& drawn) {
    FrameTiming& frame = frame_of(drawn.index);
    frame.fate = drawn.in_time ? FrameFate::in_time : FrameFate::late;
    frame.started_ns = drawn.started_ns - session_.epoch_ns;
    frame.drawn_ns = drawn.drawn_ns - session_.epoch_ns;
    frame.read_ns = drawn.read_ns - session_.epoch_ns;
    auto tip = std::ranges::lower_bound(result_.tips, drawn.index, {}, &DrawnTip::frame);
    for (; tip != result_.tips.end() && tip->frame == drawn.index; ++tip) tip->shown = drawn.in_time;
    return frame;
}

RealtimeResult RealtimeRun::finish() {
    if (session_.frames) {
        session_.frames->finish();
        for (const DrawnFrame& drawn : session_.frames->take_done()) settle(drawn);
        for (const auto& [index, written_ns] : session_.frames->report().written)
            frame_of(index).written_ns = written_ns - session_.epoch_ns;
        result_.frames_not_written = session_.frames->report().not_written;
    }
    take_notes();
    take_blocks();
    if (session_.sound) {
        const audio::LivePerformance& sound = *session_.sound;
        result_.audio_device = sound.device();
        result_.device_delay_s = sound.device_delay_s();
        result_.refused_changes = sound.refused_changes();
        result_.queue_overflows = sound.queue_overflows();
        result_.device_underruns = sound.device_underruns();
        result_.device_corrections = sound.device_corrections();
        result_.midi_late = sound.late_strokes();
        result_.midi_lost = sound.lost_strokes();
    }
    result_.events = events();
    result_.clocks = session_.sensors->clocks();
    result_.priorities = session_.priorities();
    return std::move(result_);
}

void RealtimeRun::take_frames() {
    if (!session_.frames) return;
    for (const DrawnFrame& drawn : session_.frames->take_done()) {
        const FrameTiming& done = settle(drawn);
        const double query_start_s = to_s(done.started_ns - done.query_ns);
        const double delay_s = to_s(done.read_ns) - query_start_s;
        const double shown_s = to_s(done.shown_ns);
        if (static_cast<std::size_t>(done.quality) != quality_.level()) continue;
        if (render_lead_.measured(delay_s) > options_.play.render_lead_s && options_.lead_auto)
            change_quality(quality_.outgrown(shown_s));
        if (static_cast<std::size_t>(done.quality) != quality_.level()) continue;
        change_quality(quality_.frame(shown_s, drawn.in_time, to_s(done.read_ns - done.started_ns)));
    }
}

void RealtimeRun::record_step(std::int64_t change) {
    const std::size_t level = quality_.level();
    result_.leads.push_back({to_s(now_ns()), render_lead_s(), sound_lead_s(), render_lead_.delay_s(),
                             sound_lead_.delay_s(), static_cast<int>(level),
                             fps_ / quality_levels()[level].rate_divisor, change});
}

void RealtimeRun::change_quality(const std::optional<std::string>& why) {
    if (!why) return;
    render_lead_.forget();
    result_.changes.push_back(*why);
    record_step(static_cast<std::int64_t>(result_.changes.size()) - 1);
}

void RealtimeRun::follow_delays() {
    const double at_s = to_s(now_ns());
    if (at_s - last_step_s_ < kStepS) return;
    last_step_s_ = at_s;
    if (session_.sound) {
        const audio::BlockCount blocks = session_.sound->block_count();
        const std::size_t late = blocks.late - late_blocks_seen_, all = blocks.all - blocks_seen_;
        blocks_seen_ = blocks.all, late_blocks_seen_ = blocks.late;
        if (session_.frames) change_quality(quality_.blocks(at_s, all, late));
    }
    record_step();
}

void RealtimeRun::take_notes() {
    if (!session_.sound) return;
    for (audio::PlayedNote& played : session_.sound->take_played()) {
        if (played.id >= kFirstPedalId) continue;  // no strike
        played.taken_ns -= session_.epoch_ns;
        if (played.midi_sent_ns != 0) played.midi_sent_ns -= session_.epoch_ns;
        NoteTiming note;
        note.late_s = static_cast<double>(played.onset_sample - played.planned_sample) / audio::kSampleRate;
        note.played = played;
        result_.notes.push_back(note);
    }
}

void RealtimeRun::take_blocks() {
    if (!session_.sound) return;
    for (audio::BlockTiming& block : session_.sound->take_blocks()) {
        for (std::int64_t* ns : {&block.planned_ns, &block.started_ns, &block.done_ns})
            *ns -= session_.epoch_ns;
        result_.blocks.push_back(block);
    }
}

void RealtimeRun::keep(const SensorEvent& event) {
    event_heads_.push_back({event.kind, event.at_s, event.sticks.size()});
    event_texts_.push_back(event.message);
    for (const std::string& stick : event.sticks) event_texts_.push_back(stick);
}

std::vector<SensorEvent> RealtimeRun::events() const {
    std::vector<SensorEvent> all;
    std::size_t text = 0;
    for (const EventHead& head : event_heads_) {
        SensorEvent event{head.kind, head.at_s, {}, std::string(event_texts_[text++])};
        for (std::size_t i = 0; i < head.sticks; ++i) event.sticks.emplace_back(event_texts_[text++]);
        all.push_back(std::move(event));
    }
    return all;
}

std::uint64_t RealtimeRun::refused() const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < sticks_.size(); ++i)
        if (const auto state = session_.sensors->newest(i)) sum += state->refused;
    return sum;
}

void RealtimeRun::run(const Warn& warn) {
    if (session_.sound) session_.sound->start(session_.epoch_ns);
    const BusyThreads load(options_.disturbance, session_.epoch_ns);
    session_.control_priority = set_thread_priority(ThreadRole::control, options_.realtime_priority);
    ProgressBar bar(options_.play.progress);
    const StopSignals signals;
    end_s_ = session_.seconds;
    double watched_s = 0;
    for (;;) {
        const double now_s = to_s(now_ns());
        if (now_s >= end_s_ || StopSignals::stopped() || (session_.sensors->ended() && now_s > 0)) break;
        if (session_.sound && session_.sound->failed()) break;  // which its end throws
        double next_s = end_s_;
        if (session_.frames) next_s = std::min(next_s, next_frame_at_s());
        wait(to_ns(next_s));
        take_pedals();
        take_states();
        if (session_.frames) ask_for_frames();
        take_frames();
        take_notes();
        take_blocks();
        follow_delays();
        if (now_s - watched_s < kWatchS) continue;
        watched_s = now_s;
        for (const SensorEvent& event : session_.sensors->watch()) {
            warn(event.message);
            keep(event);
        }
        bar.show(now_s / end_s_);
    }
    take_states();
    end_s_ = std::min(end_s_, to_s(now_ns()));
    end_lap();  // what is pending is played
    pedals_.end_at(std::llround(end_s_ * audio::kSampleRate));
    result_.seconds = end_s_;
    result_.laps = lap_ + 1;  // also those that no sample came from
    bar.clear();
    leave_thread_priority();
}

}  // namespace app
