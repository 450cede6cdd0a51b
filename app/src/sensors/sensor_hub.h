#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sensors/sensor_process.h"

namespace app {

/// What happened to a sensor that the user should know.
struct SensorEvent {
    enum class Kind { silent, back, restarted, ended, clock_jumped, clocks_apart, malformed, failed };
    Kind kind = Kind::silent;
    double at_s = 0;  ///< since the epoch
    std::vector<std::string> sticks;
    std::string message;  ///< one line, complete
};

/// What the sticks of a run have taught their predictors' networks, and those of whom it is not known: their
/// process was killed, or had no memory to say it in.
struct LearnedBySticks {
    std::vector<tracking::Experience> experiences;
    std::vector<std::string> silent;  ///< by name
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
    [[nodiscard]] int wake_fd() const { return wake_.get(); }
    void clear_wake();
    /// The stick's newest state; bounded time, never blocks, no system call.
    [[nodiscard]] std::optional<tracking::StickState> newest(std::size_t stick) const noexcept {
        return memory_[stick]->state.read();
    }
    /// Looks after the processes (call it some times a second): restarts dead ones; what happened since the
    /// last call.
    [[nodiscard]] std::vector<SensorEvent> watch();
    /// Every source has ended, and all that it gave has been published.
    [[nodiscard]] bool ended() const;
    [[nodiscard]] std::vector<ClockReport> clocks() const;  ///< one per stick
    /// Ends the sensors and returns what the sticks have taught their predictors' networks; nothing unless the options
    /// want it (`keep_learned`).
    [[nodiscard]] LearnedBySticks end_and_take_learned();
    /// How a live stream began.
    [[nodiscard]] SharedStreamHead stream_head() const {
        return memory_.front()->head.read().value_or(SharedStreamHead{});
    }
    [[nodiscard]] int restarts() const { return restarts_; }

private:
    struct Sensor {
        SensorTask task;
        FileDescriptor learned{};
        std::vector<std::size_t> sticks;  ///< indices of the run
        int pid = -1;                     ///< -1: not running
        int status = 0;                   ///< of waitpid, once it has ended
        bool over = false;                ///< and will not be started again
        std::deque<std::int64_t> restarts_ns{};
    };
    /// What was last seen of a stick, so that each change is reported once.
    struct SeenStick {
        std::uint64_t samples = 0;
        std::int64_t heard_ns = 0;         ///< when the newest sample was read, or should have begun to come
        std::int64_t silent_since_ns = 0;  ///< 0: not silent
        std::uint64_t pid = 0;             ///< that the counts of the process below are of
        std::uint64_t jumps = 0, malformed = 0;
        std::int64_t jump_told_ns = 0;
        /// Since when its clock has been far from another stick's, and from this machine's; 0: it is not, < 0: that was told.
        std::int64_t far_from_other_ns = 0, far_from_ours_ns = 0;
    };

    void start(Sensor& sensor) const;
    [[nodiscard]] SensorReport report_of(const Sensor& sensor) const;
    void wait_until_ready();
    [[noreturn]] void fail_start(const std::string& message);
    void add(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks, const std::string& text);
    void fail(const Sensor& sensor, const std::string& why);
    void hear(std::size_t index, const std::optional<tracking::StickState>& state);
    void watch_stick(std::size_t index);
    void watch_clock(std::size_t index);
    void watch_clocks_of(const Sensor& sensor);
    [[nodiscard]] static bool lasts(bool far, std::int64_t& since_ns);
    void watch_source(const Sensor& sensor);
    void look_after(Sensor& sensor);
    void restart(Sensor& sensor);
    void end_all();

    SensorOptions options_;
    // An eventfd and a pipe that the sensors inherit. The pipe ends with this process, however that ends.
    FileDescriptor wake_;
    Pipe life_ = make_pipe();
    std::vector<SharedSensorMemory> memory_;  // one for each stick, as the next
    std::vector<SeenStick> seen_;
    std::vector<Sensor> sensors_;
    std::vector<SensorEvent> events_;  // since the last watch()
    int restarts_ = 0;
};

}  // namespace app
