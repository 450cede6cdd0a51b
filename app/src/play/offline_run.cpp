#include "play/offline_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "play/note_of_strike.h"
#include "play/play_setup.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr double kSlackS = 1e-9;  // of the causality rules

std::vector<StickFilters> filters_of(const tracking::Trace& trace, const PlayOptions& options) {
    const StickPredictors predictors =
        stick_predictors(options.picture_predictor, options.sound_predictor, options.sound_lead_s);
    std::vector<StickFilters> filters;
    for (const tracking::StickTrace& stick : trace.sticks) filters.emplace_back(predictors, stick.name);
    return filters;
}

std::vector<Stick> sticks_of(const tracking::Trace& trace, const PlayOptions& options,
                             const StickGeometry& geometry) {
    std::vector<Stick> sticks;
    for (std::uint32_t i = 0; i < trace.sticks.size(); ++i)
        sticks.emplace_back(i, geometry, options.sound_lead_s);
    return sticks;
}

}  // namespace

OfflineRun::OfflineRun(const tracking::Trace& trace, const Kit& kit, const PlayOptions& options,
                       const StickGeometry& stick, sim::Simulation& simulation, const KitStage& stage,
                       FrameThread* frames, audio::Performance* performance)
    : trace_(trace),
      kit_(kit),
      options_(options),
      stage_(stage),
      frames_(frames),
      performance_(performance),
      t0_s_(trace.t0_s()),
      t_end_s_(trace.t_end_s()),
      filters_(filters_of(trace, options)),
      states_(trace.sticks.size()),
      sticks_(sticks_of(trace, options, stick)),
      pipeline_(kit, strike_rules(options, trace.t0_s()), stick.radius_m, sticks_, simulation,
                [this](const Strike& strike, bool scheduled) { send(strike, scheduled); }) {}

LoopTimes OfflineRun::times() const {
    LoopTimes sum = pipeline_.times();
    sum.tracking += times_.tracking;
    sum.waiting_for_frames += times_.waiting_for_frames;
    return sum;
}

std::vector<OfflineRun::Tick> OfflineRun::ticks() const {
    struct Entry {
        double t_s;
        std::uint32_t stick;
        std::size_t index;
    };
    std::vector<Entry> entries;
    for (std::uint32_t stick = 0; stick < trace_.sticks.size(); ++stick)
        for (std::size_t i = 0; i < trace_.sticks[stick].samples.size(); ++i)
            entries.push_back({trace_.sticks[stick].samples[i].t_s, stick, i});
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.t_s < b.t_s; });
    std::vector<Tick> result;
    for (const Entry& entry : entries) {
        if (result.empty() || entry.t_s > result.back().t_s) result.push_back({entry.t_s, {}});
        result.back().samples.emplace_back(entry.stick, entry.index);
    }
    return result;
}

void OfflineRun::run(const std::function<void(double)>& progress) {
    const std::vector<Tick> all = ticks();
    draw_frames(-std::numeric_limits<double>::infinity(), all.front().t_s);
    for (std::size_t i = 0; i < all.size(); ++i) {
        take(all[i]);
        draw_frames(all[i].t_s,
                    i + 1 < all.size() ? all[i + 1].t_s : std::numeric_limits<double>::infinity());
        if (i % 64 == 0) progress(static_cast<double>(i) / static_cast<double>(all.size()));
    }
    pipeline_.finish();
}

std::vector<std::uint32_t> OfflineRun::feed(const Tick& tick) {
    const Stopwatch watch(times_.tracking);
    std::vector<std::uint32_t> moved;
    for (const auto& [stick, index] : tick.samples) {
        const tracking::SampleStatus status =
            filters_[stick].correct(trace_.sticks[stick].samples[index], states_[stick]);
        sticks_[stick].take(states_[stick]);
        if (!is_taken(status)) {
            ++refused_;
            continue;
        }
        if (status == tracking::SampleStatus::reinitialised) pipeline_.restart(stick);
        moved.push_back(stick);
    }
    return moved;
}

void OfflineRun::take(const Tick& tick) {
    pipeline_.advance_to(tick.t_s);
    if (performance_) {
        // Notes before this are fixed; those that this sample may still change lie at or after it.
        const double fixed = (tick.t_s + options_.release_margin_s - t0_s_) * audio::kSampleRate;
        performance_->advance_to(static_cast<std::int64_t>(std::floor(fixed)));
    }
    const std::vector<std::uint32_t> moved = feed(tick);
    pipeline_.take(tick.t_s, moved);
}

void OfflineRun::send(const Strike& strike, bool scheduled) {
    if (!performance_ || (options_.solo && *options_.solo != strike.id)) return;
    if (scheduled)
        performance_->schedule(note_of(strike, kit_.instruments[strike.instrument]));
    else
        performance_->cancel(strike.id);
}

void OfflineRun::draw_frames(double s, double next) {
    if (!frames_) return;
    for (;; ++next_frame_) {
        const double elapsed = static_cast<double>(next_frame_) / options_.fps;
        const double T = t0_s_ + elapsed;
        if (!(elapsed < t_end_s_ - t0_s_) || T - options_.render_lead_s + kSlackS >= next) return;
        draw_frame(s, T);
    }
}

void OfflineRun::draw_frame(double s, double T) {
    std::vector<std::optional<tracking::PosePrediction>> poses(sticks_.size());
    std::vector<sim::ModalState> bodies;
    if (std::isfinite(s)) {
        FrameContents scene = pipeline_.scene(s, T);
        for (std::size_t i = 0; i < poses.size(); ++i)
            if (scene.sticks[i]) poses[i] = scene.sticks[i]->pose;
        bodies = std::move(scene.bodies);
    }
    const Stopwatch watch(times_.waiting_for_frames);
    frames_->push({.index = next_frame_, .state = stage_.frame(bodies, poses)});
}

}  // namespace app
