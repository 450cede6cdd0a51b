#pragma once
#include <audio/live_performance.h>
#include <sim/simulation.h>

#include <functional>
#include <memory>
#include <vector>

#include "kit/kit.h"
#include "latency/timings.h"
#include "pictures/frame_thread.h"
#include "pictures/kit_stage.h"
#include "play/play_options.h"
#include "play/strike_pipeline.h"
#include "realtime/artificial_load.h"
#include "realtime/lead_control.h"
#include "realtime/picture_quality.h"
#include "sensors/sensor_hub.h"
#include "sticks/stick.h"

namespace app {

/// What a run in real time was asked for, beyond PlayOptions.
struct RealtimeOptions {
    PlayOptions play;
    std::vector<std::string> sticks = {"left", "right"};  ///< names, of live sources
    std::string source;                                   ///< of the sensors; empty: the trace, replayed
    double seconds = 0;            ///< how long; 0: the trace once; live sources: until they end
    bool lead_auto = false;        ///< both leads follow the measured delays, never below those asked for
    double output_lead_s = 0.004;  ///< a block of sound is computed this long before it is due
    bool realtime_priority = true;
    std::string program;  ///< that has the command `sensor`; empty: this one
    bool jack_audio = false;
    std::string midi_port, midi_connect;
    ArtificialLoad disturbance;
    std::string disturbed_by;  ///< the same as typed, for the products
};

/// True if the sticks are live: there is no trace.
[[nodiscard]] inline bool is_live(const RealtimeOptions& options) {
    return !options.source.empty() && !options.source.starts_with("trace:");
}

/// The parts of a run that others make.
struct RealtimeParts {
    sim::Simulation& simulation;
    KitStage& stage;
    SensorHub& sensors;
    audio::LivePerformance* sound = nullptr;  ///< may be absent
    FrameThread* frames = nullptr;            ///< may be absent
};

/// A strike of a run in real time, on its lap's clock.
struct LapStrikes {
    std::uint64_t lap = 0;
    std::vector<Strike> strikes;
    std::uint64_t first_id = 0;  ///< strike i of the lap is note first_id + i + 1
};

/// The loop of a run in real time, on the calling thread, driven by CLOCK_MONOTONIC: each new state of a
/// stick goes through contacts and strikes to notes as soon as the sensor process has published it; each
/// frame is asked for a render lead before it is shown. It waits for nothing but the next sample or the next
/// frame.
///
/// Clocks: the run's counts from the epoch. A looped trace has laps of period_samples each, with a clock and
/// a StrikePipeline of their own, so that each lap is what an offline run of the trace is; strikes pending when a
/// lap ends are played.
///
/// A sample that comes so late that the sound it may change is fixed already changes what lies behind that
/// (SampleTiming::late_s).
class RealtimeRun {
public:
    RealtimeRun(const Kit& kit, const RealtimeOptions& options, const StickGeometry& stick, double t0_s,
                std::int64_t period_samples, const RealtimeParts& parts, std::size_t sticks,
                std::int64_t epoch_ns);

    /// Until the time is up, every source has ended, or `stop` says so. `warn` gets one-line messages.
    void run(double seconds, const std::function<bool()>& stop,
             const std::function<void(const std::string&)>& warn,
             const std::function<void(double)>& progress);

    /// Waits until the frames at hand are drawn and written, and completes their timings.
    void finish_frames();

    [[nodiscard]] RealtimeResult& result() { return result_; }
    [[nodiscard]] std::vector<LapStrikes>& laps() { return laps_; }
    /// Measured poses as the loop saw them, by stick, on the run's clock: the trace of a live source.
    [[nodiscard]] const std::vector<std::vector<tracking::PoseSample>>& seen() const { return seen_; }
    [[nodiscard]] double end_s() const { return end_s_; }
    [[nodiscard]] std::uint64_t refused() const;
    /// Of the sticks, also as a live source gave it.
    [[nodiscard]] const StickGeometry& geometry() const { return geometry_; }

private:
    [[nodiscard]] std::int64_t now_ns() const;
    [[nodiscard]] double lap_time_s(std::int64_t run_ns, std::uint64_t lap) const;
    [[nodiscard]] double fixed_s(std::uint64_t lap) const;
    void wait(std::int64_t until_ns);
    void take_states();
    void learn_geometry();
    void take(const std::vector<std::uint32_t>& moved, std::int64_t taken_ns, std::int64_t query_ns);
    void begin_lap(std::uint64_t lap);
    void send(const Strike& strike, bool scheduled);
    void record_sample(std::uint32_t stick, std::uint64_t skipped, std::int64_t taken_ns,
                       std::int64_t query_ns);
    /// When the next frame is to be begun: a render lead before it is shown, or up to 1 ms later while a
    /// sample of before then is on its way.
    [[nodiscard]] double next_frame_at_s() const;
    void ask_for_frames();
    void ask_for_frame(std::uint64_t index);
    /// A frame that was asked for was not drawn.
    void skipped(double shown_s);
    void record_tips(const FrameContents& scene, std::uint64_t index, double T);
    void take_frames();
    FrameTiming& settle(const DrawnFrame& drawn);
    void take_notes();
    void follow_delays();
    [[nodiscard]] double render_lead_s() const {
        return options_.lead_auto ? render_lead_.lead_s() : options_.play.render_lead_s;
    }
    [[nodiscard]] double sound_lead_s() const {
        return options_.lead_auto ? sound_lead_.lead_s() : options_.play.sound_lead_s;
    }
    [[nodiscard]] LeadStep step_now() const;
    void note_step(const std::string& why);

    const Kit& kit_;
    const RealtimeOptions& options_;
    StickGeometry geometry_;
    double t0_s_;
    std::int64_t period_samples_;
    RealtimeParts parts_;
    std::int64_t epoch_ns_;
    std::vector<Stick> sticks_;
    std::unique_ptr<StrikePipeline> pipeline_;
    std::uint64_t lap_ = 0, first_id_ = 0;
    std::string stream_head_;  // of a live source, as far as it was learnt
    double newest_s_ = 0;      // of the samples taken, on the lap's clock
    bool any_sample_ = false;
    std::vector<std::uint64_t> samples_seen_, starts_seen_;

    double fps_;
    std::uint64_t next_frame_ = 0;
    int drawing_quality_ = 0;  // of the frame at hand
    QualityRule quality_;
    // Measured always; followed with --lead auto.
    LeadControl render_lead_, sound_lead_;
    double last_step_s_ = -1;
    std::size_t blocks_seen_ = 0, late_blocks_seen_ = 0;
    double end_s_ = 0;
    std::vector<std::vector<tracking::PoseSample>> seen_;
    std::vector<LapStrikes> laps_;
    RealtimeResult result_;
};

}  // namespace app
