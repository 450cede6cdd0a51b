#pragma once
#include <audio/performance.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <functional>
#include <memory>
#include <vector>

#include "kit/kit.h"
#include "pictures/frame_thread.h"
#include "pictures/kit_stage.h"
#include "play/play_options.h"
#include "play/strike_pipeline.h"
#include "sticks/stick_filters.h"

namespace app {

/// The loop of an offline run: every sample of the trace in order of time through filters, contacts and
/// strikes to notes; every frame as soon as the last sample that it may use has been taken. Frames and
/// performance may be absent (nullptr).
class OfflineRun {
public:
    OfflineRun(const tracking::Trace& trace, const Kit& kit, const PlayOptions& options,
               const StickGeometry& stick, sim::Simulation& simulation, const KitStage& stage,
               FrameThread* frames, audio::Performance* performance);

    /// Runs to the end; `progress` gets the share done, now and then.
    void run(const std::function<void(double)>& progress);

    [[nodiscard]] const std::vector<Strike>& strikes() const { return pipeline_.strikes(); }
    [[nodiscard]] std::size_t refused() const { return refused_; }
    [[nodiscard]] LoopTimes times() const;

private:
    struct Tick {
        double t_s;
        std::vector<std::pair<std::uint32_t, std::size_t>> samples;  // stick, index
    };
    [[nodiscard]] std::vector<Tick> ticks() const;
    void take(const Tick& tick);
    [[nodiscard]] std::vector<std::uint32_t> feed(const Tick& tick);
    void send(const Strike& strike, bool scheduled);
    /// Draws the frames that may use samples up to s but not the next one, at `next`.
    void draw_frames(double s, double next);
    void draw_frame(double s, double T);

    const tracking::Trace& trace_;
    const Kit& kit_;
    const PlayOptions& options_;
    const KitStage& stage_;
    FrameThread* frames_;
    audio::Performance* performance_;
    double t0_s_, t_end_s_;
    std::vector<StickFilters> filters_;  // by stick, as the next two
    std::vector<tracking::StickState> states_;
    std::vector<Stick> sticks_;
    StrikePipeline pipeline_;
    std::size_t next_frame_ = 0;
    std::size_t refused_ = 0;
    LoopTimes times_;
};

}  // namespace app
