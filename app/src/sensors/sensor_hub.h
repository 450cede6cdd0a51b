#pragma once
#include <tracking/stick_state.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sensors/sensor_process.h"

namespace app {

/// What happened to a sensor that the user should know.
struct SensorEvent {
    enum class Kind { silent, back, restarted, ended, clock_jumped, malformed, failed };
    Kind kind = Kind::silent;
    double at_s = 0;  ///< since the epoch
    std::vector<std::string> sticks;
    std::string message;  ///< one line, complete
};

/// How the clock of a source's sample times relates to ours.
struct ClockReport {
    std::string clock;        ///< "the trace's own, replayed" | "the source's" | "arrival"
    double offset_s = 0;      ///< ours (since the epoch) minus the source's
    double drift_ppm = 0;     ///< of the source's clock against ours
    double delay_p95_ms = 0;  ///< of arrival beyond the least delay seen
    int jumps = 0;
};

/// How a live stream began.
struct StreamHead {
    std::string text;                           ///< its key lines and header; empty: none so far
    std::optional<Eigen::Vector3d> tip, shaft;  ///< of the sticks, body frame [m]; none: not known
};

/// Starts and watches the sensor processes (one per stick of a trace; one for all sticks where a source
/// delivers them together), each with a reader thread and a filter thread per stick, and keeps the shared memory that
/// they publish into. The memory has no name, so nothing stays in /dev/shm however a process ends. A process
/// that dies is started again, at most 5 times in 10 s. One thread.
class SensorHub {
public:
    /// Returns when the sensors are ready (tens of ms), so the epoch should lie that far ahead. Throws
    /// BadInput for a source, sticks or predictors that cannot be, before anything starts;
    /// std::runtime_error when a source cannot be opened or an external predictor does not start.
    explicit SensorHub(const SensorOptions& options);
    ~SensorHub();
    SensorHub(const SensorHub&) = delete;
    SensorHub& operator=(const SensorHub&) = delete;

    /// Readable (poll) when a state was published since the last clear_wake().
    [[nodiscard]] int wake_fd() const;
    void clear_wake();
    /// The stick's newest state; bounded time, never blocks, no system call.
    [[nodiscard]] std::optional<tracking::StickState> newest(std::size_t stick) const noexcept;
    /// Looks after the processes (call it some times a second): restarts dead ones; what happened since the
    /// last call.
    [[nodiscard]] std::vector<SensorEvent> watch();
    /// Every source has ended, and all that it gave has been published.
    [[nodiscard]] bool ended() const;
    [[nodiscard]] std::vector<ClockReport> clocks() const;  ///< one per process
    [[nodiscard]] StreamHead stream_head() const;
    [[nodiscard]] int restarts() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace app
