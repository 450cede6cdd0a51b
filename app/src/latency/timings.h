#pragma once
#include <audio/live_performance.h>

#include <cstdint>
#include <string>
#include <vector>

#include "files/disk_log.h"
#include "sensors/sensor_hub.h"
#include "strikes/strike.h"

namespace app {

/// How a sample came through. Nanoseconds since the run's epoch.
struct SampleTiming {
    std::uint32_t stick = 0;
    std::uint64_t lap = 0;
    double t_s = 0;                                         ///< the sample's own time
    std::int64_t due_ns = 0, read_ns = 0, filtered_ns = 0;  ///< StickState
    std::int64_t taken_ns = 0;                              ///< the application had it
    std::int64_t query_ns = 0;                              ///< duration of the query of shared memory
    std::int64_t contact_ns = 0;                            ///< the simulation had answered
    std::int64_t handed_ns = 0;                             ///< its changes of notes were with the audio
    std::uint64_t skipped = 0;  ///< samples of this stick just before it that the application never saw
    double late_s = 0;  ///< the sound was fixed this far beyond what the sample may change; <= 0: in time
};

enum class FrameFate : std::uint8_t { in_time, late, skipped };
// late: ready after it was due, and dropped; skipped: not drawn, since the one before was still being drawn
// or the rate was lowered (then it is not counted as asked for).

struct FrameTiming {
    std::uint64_t index = 0;
    FrameFate fate = FrameFate::in_time;
    bool asked_for = true;           ///< false: left out because the rate was lowered
    double lead_s = 0;               ///< render lead in force
    int quality = 0;                 ///< level of picture quality, 0 the best
    double oldest_sample_age_s = 0;  ///< shown time minus the time of the oldest stick's sample that it was
                                     ///< drawn from: the age of the pose
    std::int64_t shown_ns = 0;       ///< due on the screen: index / fps
    std::int64_t query_ns = 0;       ///< duration of querying the poses and the simulation
    std::int64_t started_ns = 0, drawn_ns = 0, read_ns = 0;  ///< drawing began, ended, pixels were there
    std::int64_t written_ns = 0;                             ///< file written; 0: not
};

/// A stick in a frame that was drawn: the tip that was predicted for it, before it is held on a surface that
/// it meets: by the pictures' filter, or, where it is held at a coming contact, by the sound's, which has
/// predicted that contact.
struct DrawnTip {
    std::uint64_t frame = 0;
    std::uint32_t stick = 0;
    std::uint64_t lap = 0;
    double t_s = 0;     ///< time that the pose was predicted for, within the lap
    bool shown = true;  ///< of a frame in time
    bool held = false;  ///< drawn on the surface instead
    Eigen::Vector3d tip = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();  ///< [m], [m/s]
    Eigen::Vector3d drawn = Eigen::Vector3d::Zero();  ///< the tip as it is drawn, held or not [m]
};

/// A note in real time.
struct NoteTiming {
    std::size_t strike = 0;  ///< index into PlayResult::strikes
    std::uint64_t lap = 0;
    double pose_age_s = 0;  ///< onset minus the time of the newest sample that could change it
    audio::PlayedNote played;
    double late_s = 0;  ///< onset in the output minus the planned one
};

/// One step of the leads or of the picture quality.
struct LeadStep {
    double at_s = 0;  ///< since the epoch
    double render_lead_s = 0, sound_lead_s = 0;
    double render_delay_s = 0, sound_delay_s = 0;  ///< the high percentiles that they follow
    int quality = 0;
    double fps = 30;
    std::int64_t change = -1;  ///< of quality or rate, index into RealtimeResult::changes; -1: none
};

/// What a run in real time measured, beside its PlayResult.
struct RealtimeResult {
    double seconds = 0;   ///< of the run
    double period_s = 0;  ///< of a looped trace
    std::uint64_t laps = 1;
    double output_lead_s = 0;
    std::vector<std::string> quality_levels;  ///< what each level draws
    DiskLog<SampleTiming> samples;
    DiskLog<FrameTiming> frames;
    DiskLog<DrawnTip> tips;  ///< in order of frame, then stick
    DiskLog<NoteTiming> notes;
    DiskLog<audio::BlockTiming> blocks;  ///< nanoseconds since the epoch
    DiskLog<LeadStep> leads;
    TextLog changes;  ///< why quality or rate were changed: one line each
    std::vector<SensorEvent> events;
    std::vector<ClockReport> clocks;
    std::vector<std::pair<std::string, std::string>> priorities;  ///< thread, what it obtained
    std::string audio_device, disturbed_by;
    double device_delay_s = 0;  ///< how much later than due the device plays
    std::uint64_t refused_changes = 0, queue_overflows = 0, device_underruns = 0, frames_not_written = 0;
    std::uint64_t midi_late = 0, midi_lost = 0, device_corrections = 0;

    /// Of a step that changed the quality or the rate; empty: it did not.
    [[nodiscard]] std::string why(const LeadStep& step) const {
        return step.change < 0 ? std::string() : std::string(changes[static_cast<std::size_t>(step.change)]);
    }
};

}  // namespace app
