#pragma once
#include <audio/performance.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <functional>
#include <memory>
#include <vector>

#include "drawn_strikes.h"
#include "frame_writer.h"
#include "kit.h"
#include "play.h"
#include "stage.h"
#include "stick_tracker.h"
#include "strike_scheduler.h"

namespace app {

/// Seconds of wall time in each part of the loop.
struct LoopTimes {
    double tracking = 0, simulation = 0, strikes = 0, waiting_for_frames = 0;
};

/// The loop of an offline run: every sample of the trace in order of time through filters, contacts and
/// strikes to notes; every frame as soon as the last sample that it may use has been taken. Frames and
/// performance may be absent (nullptr).
class OfflineRun {
public:
    OfflineRun(const tracking::Trace& trace, const Kit& kit, const PlayOptions& options,
               const StickGeometry& stick, sim::Simulation& simulation, const Stage& stage,
               FrameWriter* frames, audio::Performance* performance);

    /// Runs to the end; `progress` gets the share done, now and then.
    void run(const std::function<void(double)>& progress);

    [[nodiscard]] const std::vector<Strike>& strikes() const { return scheduler_.strikes(); }
    [[nodiscard]] std::size_t refused() const { return refused_; }
    [[nodiscard]] const LoopTimes& times() const { return times_; }

private:
    struct Tick {
        double t_s;
        std::vector<std::pair<std::uint32_t, std::size_t>> samples;  // stick, index
    };
    [[nodiscard]] std::vector<Tick> ticks() const;
    void take(const Tick& tick);
    void feed(const Tick& tick, std::vector<std::uint32_t>& moved, std::vector<sim::TipPath>& paths);
    void take_contacts(double s, const std::vector<std::uint32_t>& moved, const sim::StepReply& reply);
    void send_notes();
    void settle_impulses(double s, sim::StepRequest& request);
    /// Draws the frames that may use samples up to s but not the next one, at `next`.
    void draw_frames(double s, double next);
    void draw_frame(double s, double T);
    /// The time of the pose drawn at T: a stick that is predicted to strike between s and T is drawn on the
    /// surface, not beyond it; one that has just struck and whose filter has not yet seen the rebound is
    /// drawn as it was at s.
    [[nodiscard]] double until_contact(std::uint32_t stick, double s, double T) const;

    const tracking::Trace& trace_;
    const Kit& kit_;
    const PlayOptions& options_;
    sim::Simulation& simulation_;
    const Stage& stage_;
    FrameWriter* frames_;
    audio::Performance* performance_;
    double tip_radius_m_;
    double t0_s_, t_end_s_;
    StrikeScheduler scheduler_;
    DrawnStrikes drawn_;
    std::vector<StickTracker> sticks_;
    std::vector<std::uint64_t> unfolded_;  // released strikes whose impulses lie ahead
    std::size_t next_frame_ = 0;
    std::size_t refused_ = 0;
    LoopTimes times_;
};

}  // namespace app
