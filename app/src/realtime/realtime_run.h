#pragma once
#include <memory>
#include <vector>

#include "latency/timings.h"
#include "play/strike_pipeline.h"
#include "process/clock.h"
#include "realtime/lead_control.h"
#include "realtime/picture_quality.h"
#include "realtime/realtime_session.h"

namespace app {

/// The strikes of a lap, on its clock.
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
/// A sample whose notes are handed over so late that the sound it may change is fixed already changes what lies behind that
/// (SampleTiming::late_s).
class RealtimeRun {
public:
    /// The session's parts have been started.
    explicit RealtimeRun(RealtimeSession& session);

    /// Until the time is up, every source has ended, or SIGINT or SIGTERM came.
    void run(const Warn& warn);
    /// Waits until the frames at hand are drawn and written, and completes the measurements; after the sound
    /// was finished.
    [[nodiscard]] RealtimeResult finish();

    [[nodiscard]] std::vector<SensorEvent> events() const;
    [[nodiscard]] const std::vector<LapStrikes>& laps() const { return laps_; }
    /// Measured poses as the loop saw them, by stick, on the run's clock: the trace of a live source.
    [[nodiscard]] const std::vector<DiskLog<tracking::PoseSample>>& seen() const { return seen_; }
    [[nodiscard]] const Pedals& pedals() const { return pedals_; }  ///< on the run's clock
    [[nodiscard]] double end_s() const { return end_s_; }
    [[nodiscard]] std::uint64_t refused() const;

private:
    [[nodiscard]] std::int64_t now_ns() const { return monotonic_ns() - session_.epoch_ns; }
    [[nodiscard]] double lap_time_s(std::int64_t run_ns) const;
    [[nodiscard]] double fixed_s() const;
    void wait(std::int64_t until_ns);
    void take_states();
    void learn_geometry();
    void take(const std::vector<std::uint32_t>& moved, std::int64_t taken_ns, std::int64_t query_ns);
    void begin_lap(std::uint64_t lap);
    void end_lap();
    void send(audio::Note note, bool scheduled);
    void take_pedals();
    void choke(const TipRest& rest);
    /// To the sound: what pedals, hands and tips play.
    void send_pedals();
    /// When the next frame is to be begun: a render lead before it is shown, or up to 1 ms later while a
    /// sample of before then is on its way.
    [[nodiscard]] double next_frame_at_s() const;
    void ask_for_frames();
    void ask_for_frame(std::uint64_t index);
    /// A frame that was asked for was not drawn.
    void skipped(double shown_s);
    void record_tips(const FrameContents& scene, std::uint64_t index, double T);
    void take_frames();
    [[nodiscard]] FrameTiming& frame_of(std::uint64_t index);
    FrameTiming& settle(const DrawnFrame& drawn);
    void take_notes();
    void take_blocks();
    void follow_delays();
    [[nodiscard]] double render_lead_s() const {
        return options_.lead_auto ? render_lead_.lead_s() : options_.play.render_lead_s;
    }
    [[nodiscard]] double sound_lead_s() const {
        return options_.lead_auto ? sound_lead_.lead_s() : options_.play.sound_lead_s;
    }
    void record_step(std::int64_t change = -1);
    void keep(const SensorEvent& event);
    void change_quality(const std::optional<std::string>& why);

    RealtimeSession& session_;
    const RealtimeOptions& options_;
    double t0_s_;
    Pedals pedals_;
    std::size_t next_move_ = 0;                     // of the session's, in this lap
    std::size_t notes_sent_ = 0, places_sent_ = 0;  // of the pedals
    std::vector<Stick> sticks_;
    std::unique_ptr<StrikePipeline> pipeline_;
    std::uint64_t lap_ = 0, first_id_ = 0;
    std::string stream_head_;  // of a live source, as far as it was learnt
    double newest_s_ = 0;      // of the samples taken, on the lap's clock
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
    std::vector<DiskLog<tracking::PoseSample>> seen_;
    std::vector<LapStrikes> laps_;
    /// A SensorEvent without its texts: the message and the sticks' names, which follow each other in event_texts_.
    struct EventHead {
        SensorEvent::Kind kind;
        double at_s;
        std::size_t sticks;
    };
    DiskLog<EventHead> event_heads_;
    TextLog event_texts_;
    RealtimeResult result_;
};

}  // namespace app
