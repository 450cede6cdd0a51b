#pragma once
#include <tracking/newest_value.h>
#include <tracking/stick_state.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "files/file_descriptor.h"
#include "sensors/sample_source.h"
#include "sensors/source_clock.h"
#include "sticks/stick.h"

namespace app {

enum class SensorPhase : std::uint64_t { starting, running, ended, failed };

/// How a sensor process is, for its hub. One for each stick; what concerns the process is the same in all.
struct SensorReport {
    std::uint64_t pid = 0;
    SensorPhase phase = SensorPhase::starting;
    std::int64_t quiet_until_ns = 0;  ///< no sample is expected before
    double interval_s = 0;            ///< between the stick's samples, smoothed; 0: not known
    std::uint64_t read = 0;           ///< samples of the stick that the reader got
    std::uint64_t malformed = 0;      ///< messages or rows
    ClockReport clock;                ///< of the stick's samples
    std::array<char, 256> text{};     ///< why it failed, or what the first malformed message was; ends with 0

    void set_text(std::string_view line);
};

/// The first lines of a live stream, which say how to read the rest: a sensor that is started again in
/// mid-stream needs them; and what they say of the sticks.
struct SharedStreamHead {
    std::array<char, 2048> text{};              ///< ends with 0
    std::optional<Eigen::Vector3d> tip, shaft;  ///< body frame [m]
};

}  // namespace app

/// Numbers and arrays of numbers; std::optional of one is a flag beside it, and both sides are the same program.
template <>
inline constexpr bool tracking::kCopiesAsBytes<app::SharedStreamHead> = true;

namespace app {

/// What a sensor process and its hub share of one stick.
struct SensorMemory {
    std::uint64_t version = 0;  ///< StickState::kVersion of who made it
    tracking::NewestValue<tracking::StickState> state;
    tracking::NewestValue<SensorReport> report;
    tracking::NewestValue<SharedStreamHead> head;
};

/// A SensorMemory in memory that processes share by its descriptor, unmapped at the end. It has no name, so
/// nothing stays in /dev/shm however a process ends.
class SharedSensorMemory {
public:
    /// New memory of zeros. Throws std::runtime_error.
    SharedSensorMemory();
    /// The memory of a descriptor that this process inherited; takes the descriptor over. Throws
    /// std::runtime_error, also for memory of another build.
    explicit SharedSensorMemory(int descriptor);

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }
    [[nodiscard]] SensorMemory& operator*() const { return *memory_; }
    [[nodiscard]] SensorMemory* operator->() const { return memory_.get(); }

private:
    struct Unmap {
        void operator()(SensorMemory* memory) const;
    };
    void map();

    FileDescriptor descriptor_;
    std::unique_ptr<SensorMemory, Unmap> memory_;
};

/// The sensors of a run: their source, with `epoch_ns` also that of live times, and their predictors.
struct SensorOptions : SourceOptions {
    StickPredictors predictors;
    double stall_at_s = -1, stall_s = 0;  ///< --disturb: a pause of the reader, for tests; < 0: none
    bool realtime = true;                 ///< real-time scheduling where that is permitted
    std::string program{};                ///< that has the command `sensor`; empty: this one
    bool keep_learned = false;            ///< what was learned is wanted at the end
};

/// The sticks of one sensor process. Descriptors are inherited from the hub.
struct SensorTask : SensorOptions {
    std::vector<int> state_fds;  ///< shared memory, one for each stick
    int wake_fd = -1;            ///< eventfd that is written after each publication
    int life_fd = -1;            ///< a pipe that ends with the hub
    int learned_fd = -1;  ///< memory that gets what the sticks taught, at the end (bytes_of); -1: not wanted
};

/// Calls field(name, member, help) for all that the command `sensor` is started with.
void for_each_sensor_option(auto& task, const auto& field) {
    field("--source", task.source, "trace:FILE, stdin, zmq:ENDPOINT or osc:PORT");
    field("--stick", task.sticks, "Name; once for each stick");
    field("--epoch-ns", task.epoch_ns, "CLOCK_MONOTONIC at which the run begins [ns]");
    field("--period", task.period_s, "A trace begins again that long after it began [s]; 0: never");
    field("--resume", task.resume, "Go on at the current time");
    field("--stall-at", task.stall_at_s, "Pause the reader then [s since the epoch]");
    field("--stall", task.stall_s, "for that long [s]");
    field("--picture", task.predictors.picture, "Predictor of pictures");
    field("--sound", task.predictors.sound, "Predictor of sound");
    field("--confirming", task.predictors.confirming, "Predictor that confirms contacts; none if left out");
    field("--sound-lead", task.predictors.sound_lead_s, "Contacts are looked for so far ahead [s]");
    field("--shaft-x", task.predictors.shaft.x(), "Of the tracked body, from hand to tip, unit");
    field("--shaft-y", task.predictors.shaft.y(), "likewise");
    field("--shaft-z", task.predictors.shaft.z(), "likewise");
    field("--state-fd", task.state_fds, "Shared memory; once for each stick");
    field("--wake-fd", task.wake_fd, "eventfd");
    field("--life-fd", task.life_fd, "Pipe that ends with the application");
    field("--learned-fd", task.learned_fd, "Memory for what was learned; -1: none");
    field("--realtime", task.realtime, "Real-time scheduling where that is permitted");
}

/// A sensor process: one thread reads the source at its own pace, one per stick filters and publishes (a slow
/// external predictor holds up its own stick alone), and this one reports and watches for the end. Returns the
/// exit status: 0 when the source has ended or the hub is gone; 1 when it failed, which its report says. SIGTERM
/// ends it in order, as a process that was ended by it; SIGINT and SIGHUP are the hub's to answer.
[[nodiscard]] int run_sensor(const SensorTask& task);

/// The words after the program's name with which the command `sensor` gets a task.
[[nodiscard]] std::vector<std::string> sensor_arguments(const SensorTask& task);

}  // namespace app
