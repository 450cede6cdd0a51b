#include "play/play.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>

#include "files/bad_input.h"
#include "pictures/kit_stage.h"
#include "pictures/motion_blur.h"
#include "play/play_run.h"
#include "play/strike_marks.h"
#include "play/strike_pipeline.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "sticks/learned_in_play.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"
#include "sticks/trace_warnings.h"

namespace app {
namespace {

constexpr double kSlackS = 1e-9;  // of the causality rules
constexpr double kEver = std::numeric_limits<double>::infinity();

/// What is played, and what plays it: pictures and sound may be absent.
struct OfflineParts {
    const tracking::Trace& trace;
    const Kit& kit;
    const PlayOptions& options;
    const StickGeometry& stick;
    sim::Simulation& simulation;
    const KitStage* stage = nullptr;
    FrameThread* frames = nullptr;
    audio::Performance* sound = nullptr;
    Pedals* pedals = nullptr;
};

/// The loop of an offline run: every sample of the trace in order of time through filters, contacts and
/// strikes to notes; every frame as soon as the last sample that it may use has been taken.
class OfflineRun {
public:
    explicit OfflineRun(const OfflineParts& parts)
        : parts_(parts),
          t0_s_(parts.trace.t0_s()),
          t_end_s_(parts.trace.t_end_s()),
          states_(parts.trace.sticks.size()) {
        const PlayOptions& o = parts.options;
        const StickPredictors predictors =
            stick_predictors(o.picture_predictor, o.sound_predictor, o.sound_lead_s, parts.stick.shaft);
        for (const tracking::StickTrace& stick : parts.trace.sticks) {
            filters_.emplace_back(predictors, stick.name);
            sticks_.emplace_back(static_cast<std::uint32_t>(sticks_.size()), parts.stick, o.sound_lead_s);
        }
        pipeline_.emplace(
            parts.kit, pipeline_settings(o, parts.stick, t0_s_), sticks_, parts.simulation,
            [this](const audio::Note& note, bool scheduled) { send(note, scheduled); },
            contact_model(o.sound_predictor));
        if (parts.pedals)
            for (const PedalNote& pedal : parts.pedals->notes()) pipeline_->choke(pedal.note);
    }

    void run(ProgressBar& bar) {
        const std::vector<Sample> all = samples_by_time();
        draw_frames(-kEver, all.front().pose->t_s);
        for (auto first = all.begin(); first != all.end();) {
            const double s = first->pose->t_s;
            const auto next =
                std::find_if(first, all.end(), [&](const Sample& sample) { return sample.pose->t_s > s; });
            take({first, next});
            draw_frames(s, next == all.end() ? kEver : next->pose->t_s);
            bar.show(static_cast<double>(next - all.begin()) / static_cast<double>(all.size()));
            first = next;
        }
        pipeline_->finish();
        bar.clear();
    }

    [[nodiscard]] const std::vector<Strike>& strikes() const { return pipeline_->strikes(); }
    [[nodiscard]] std::vector<tracking::Experience> experiences() const {
        std::vector<tracking::Experience> all;
        for (const StickFilters& filters : filters_)
            if (std::optional<tracking::Experience> one = filters.experience())
                all.push_back(std::move(*one));
        return all;
    }
    [[nodiscard]] std::size_t refused() const { return refused_; }
    [[nodiscard]] const LoopTimes& times() const { return pipeline_->times(); }

private:
    struct Sample {
        std::uint32_t stick;
        const tracking::PoseSample* pose;
    };
    [[nodiscard]] std::vector<Sample> samples_by_time() const {
        std::vector<Sample> samples;
        for (std::uint32_t stick = 0; stick < parts_.trace.sticks.size(); ++stick)
            for (const tracking::PoseSample& pose : parts_.trace.sticks[stick].samples)
                samples.push_back({stick, &pose});
        std::ranges::stable_sort(samples, {}, [](const Sample& sample) { return sample.pose->t_s; });
        return samples;
    }

    /// Those of one time.
    void take(std::span<const Sample> samples) {
        const double s = samples.front().pose->t_s;
        pipeline_->advance_to(s);
        if (parts_.sound) {
            // Notes before this are fixed; those that this sample may still change lie at or after it.
            const double fixed = (s + parts_.options.release_margin_s - t0_s_) * audio::kSampleRate;
            parts_.sound->advance_to(static_cast<std::int64_t>(std::floor(fixed)));
        }
        pipeline_->take(s, feed(samples));
        for (const TipRest& rest : pipeline_->take_tip_rests()) choke(rest);
    }

    /// At the first sample that is not fixed yet.
    void choke(const TipRest& rest) {
        if (!parts_.pedals) return;
        const double fixed = (rest.s + parts_.options.release_margin_s - t0_s_) * audio::kSampleRate;
        const std::size_t known = parts_.pedals->notes().size();
        parts_.pedals->take({PedalMove::Kind::tip, rest.s, rest.instrument, 0, rest.stick},
                            static_cast<std::int64_t>(std::ceil(fixed)));
        for (const PedalNote& choke : std::span(parts_.pedals->notes()).subspan(known)) sound(choke.note);
    }

    std::vector<std::uint32_t> feed(std::span<const Sample> samples) {
        const Stopwatch watch(pipeline_->times().tracking);
        std::vector<std::uint32_t> moved;
        for (const auto& [stick, pose] : samples) {
            const tracking::SampleStatus status = filters_[stick].correct(*pose, states_[stick]);
            sticks_[stick].take(states_[stick]);
            if (!is_taken(status)) {
                ++refused_;
                continue;
            }
            if (status == tracking::SampleStatus::reinitialised) pipeline_->restart(stick);
            moved.push_back(stick);
        }
        return moved;
    }

    void send(audio::Note note, bool scheduled) {
        if (parts_.pedals) parts_.pedals->put_on(note);
        if (scheduled)
            sound(note);
        else if (parts_.sound)
            parts_.sound->cancel(note.id);
    }

    void sound(const audio::Note& note) {
        if (parts_.sound) parts_.sound->schedule(note);
    }

    /// Draws the frames that may use samples up to s but not the next one, at `next`.
    void draw_frames(double s, double next) {
        if (!parts_.frames) return;
        for (;; ++next_frame_) {
            const double elapsed = static_cast<double>(next_frame_) / parts_.options.fps;
            const double T = t0_s_ + elapsed;
            if (!(elapsed < t_end_s_ - t0_s_) || T - parts_.options.render_lead_s + kSlackS >= next) return;
            std::vector<render::FrameState> states = exposed(s, elapsed);
            FrameJob job{.index = next_frame_, .state = std::move(states.back())};
            states.pop_back();
            job.earlier = std::move(states);
            const Stopwatch watch(pipeline_->times().waiting_for_frames);
            parts_.frames->push(std::move(job));
        }
    }

    /// What the frame shown at t0 + elapsed shows while the shutter is open, known at s; at all moments with the
    /// ghosts and marks of the last.
    [[nodiscard]] std::vector<render::FrameState> exposed(double s, double elapsed) {
        const std::vector<double> since_t0 =
            exposure_times(elapsed, parts_.options.shutter / parts_.options.fps);
        std::vector<double> moments;
        for (const double t : since_t0) moments.push_back(t0_s_ + t);
        const std::vector<FrameContents> contents =
            std::isfinite(s) ? pipeline_->scenes(s, moments) : std::vector<FrameContents>(moments.size());
        const Annotations shown = annotations(moments.back());
        std::vector<render::FrameState> states;
        for (std::size_t i = 0; i < moments.size(); ++i)
            states.push_back(
                parts_.stage->frame(contents[i].bodies, contents[i].poses(), since_t0[i], shown));
        return states;
    }

    [[nodiscard]] Annotations annotations(double T) const {
        Annotations all;
        for (std::size_t i = 0; parts_.options.shown.ghosts && i < sticks_.size(); ++i) {
            StickGhosts& ghosts = all.ghosts.emplace_back();
            ghosts.truth = recorded_pose(parts_.trace.sticks[i], T);
            if (!sticks_[i].started()) continue;
            ghosts.measured = recorded_pose(parts_.trace.sticks[i], sticks_[i].state().t_s);
            ghosts.predicted = sticks_[i].pose_at(T);
        }
        if (parts_.options.shown.marks) all.marks = strike_marks(pipeline_->strikes(), T);
        return all;
    }

    OfflineParts parts_;
    double t0_s_, t_end_s_;
    std::vector<StickFilters> filters_;  // by stick, as the next two
    std::vector<tracking::StickState> states_;
    std::vector<Stick> sticks_;
    std::optional<StrikePipeline> pipeline_;
    std::size_t next_frame_ = 0;
    std::size_t refused_ = 0;
};

void check_solo(const PlayOptions& options, const std::vector<Strike>& strikes, const Pedals& pedals) {
    if (!options.solo) return;
    const auto is = [&](const PedalNote& pedal) {
        return pedal.note.id == *options.solo && !is_choke(pedal);
    };
    if (std::ranges::any_of(pedals.notes(), is)) return;
    const bool released = *options.solo >= 1 && *options.solo <= strikes.size() &&
                          strikes[*options.solo - 1].outcome == Outcome::released;
    if (!released)
        throw BadInput(fmt::format(
            "error: found --solo {}, expected the id of a released note of events.csv that is no choke",
            *options.solo));
}

/// The loop, from samples to strikes; returns what the sticks have taught.
std::vector<tracking::Experience> play_through(const OfflineParts& parts, PlayResult& result) {
    OfflineRun run(parts);
    ProgressBar bar(parts.options.progress);
    run.run(bar);
    result.strikes = run.strikes();
    check_solo(parts.options, result.strikes, result.pedals);
    result.samples_refused = run.refused();
    const LoopTimes& times = run.times();
    result.stages_s.insert(result.stages_s.end(), {{"tracking", times.tracking},
                                                   {"simulation", times.simulation},
                                                   {"strikes", times.strikes},
                                                   {"waiting for frames", times.waiting_for_frames}});
    return run.experiences();
}

}  // namespace

PlayResult play(const PlayOptions& options) {
    const WallTimer wall;
    require_tools(options);
    const PlayedTrace trace = read_played_trace(options.trace);
    const Kit kit = read_kit(options.kit);
    const StickGeometry stick = stick_geometry(trace, kit.stick, options.tip, options.shaft);
    PlayResult result = describe(options, trace, kit);
    std::optional<LearnedModel> learned;
    if (options.save_model)
        learned.emplace(
            LearnedInPlay{*options.save_model, "play", result.options.picture_predictor, result.trace});
    result.tracks = tip_tracks(trace, stick);
    result.pedals = Pedals(kit, trace.t0_s());
    if (options.pedals) {
        std::vector<PedalMove> moves = read_pedals(*options.pedals, kit, trace.t0_s());
        result.pedal_moves_left_out = leave_out(moves, trace.t0_s(), trace.t_end_s());
        for (const PedalMove& move : moves) result.pedals.take(move);
    }
    OutputFolder folder(options.out);

    const KitStage stage(kit, trace.sticks.size(), stick, options.camera, options.shown);
    const std::unique_ptr<FrameThread> frames =
        start_frames(options, {stage.scene(options.width, options.height)}, stage.frame({}, {}), folder);
    const auto sound = options.audio ? std::make_unique<audio::Performance>(orchestra_file(), voices_of(kit),
                                                                            mix_of(options, kit))
                                     : nullptr;
    const std::unique_ptr<sim::Simulation> simulation = make_simulation(kit, options.workers);
    result.stages_s.emplace_back("start", wall.seconds());

    const auto schedule = [&](const audio::Note& note) {
        if (sound) sound->schedule(note);
    };
    for (const PedalNote& pedal : result.pedals.notes()) schedule(pedal.note);
    for (const audio::Note& place : result.pedals.places()) schedule(place);
    const std::vector<tracking::Experience> taught = play_through(
        {trace, kit, options, stick, *simulation, &stage, frames.get(), sound.get(), &result.pedals}, result);
    warn_of_units(trace);  // now that nothing is left to be refused, which is said in one line
    const double sound_s = seconds_of([&] {
        if (sound) finish_sound(*sound, trace.t_end_s() - trace.t0_s(), result, kit, folder);
    });
    result.stages_s.emplace_back("sound (waiting and writing)", sound_s);
    write_products(result, {kit, stick, *simulation, frames.get(), wall}, folder);
    if (learned) learned->save_or_say(taught, {}, result.failures);
    return result;
}

std::vector<Strike> offline_strikes(const tracking::Trace& trace, const Kit& kit, const PlayOptions& options,
                                    const StickGeometry& stick, const std::vector<PedalMove>& moves) {
    const std::unique_ptr<sim::Simulation> simulation = make_simulation(kit, 0);
    Pedals pedals(kit, trace.t0_s());
    for (const PedalMove& move : moves) pedals.take(move);
    OfflineRun run({.trace = trace,
                    .kit = kit,
                    .options = options,
                    .stick = stick,
                    .simulation = *simulation,
                    .pedals = &pedals});
    ProgressBar none(false);
    run.run(none);
    return run.strikes();
}

}  // namespace app
