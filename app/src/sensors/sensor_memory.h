#pragma once
#include <tracking/newest_value.h>
#include <tracking/stick_state.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "files/file_descriptor.h"

namespace app {

enum class SensorPhase : std::uint64_t { starting, running, ended, failed };

/// Whose clock the times of samples are.
enum class SampleClock : std::uint64_t { replayed, source, arrival };

/// How a sensor process is, for its hub. One a stick; what concerns the process is the same in all.
struct SensorReport {
    std::uint64_t pid = 0;
    SensorPhase phase = SensorPhase::starting;
    std::int64_t quiet_until_ns = 0;  ///< no sample is expected before
    double interval_s = 0;            ///< between the stick's samples, smoothed; 0: not known
    std::uint64_t read = 0;           ///< samples of the stick that the reader got
    std::uint64_t malformed = 0, foreign = 0, lost = 0;
    SampleClock clock = SampleClock::replayed;
    double offset_s = 0, drift_ppm = 0, delay_p95_ms = 0;
    std::uint64_t jumps = 0;
    double last_jump_s = 0;
    std::array<char, 256> text{};  ///< why it failed, or what the first malformed message was; ends with 0

    void set_text(std::string_view line);
};

/// The first lines of a live stream, which say how to read the rest: a sensor that is started again in
/// mid-stream needs them; and what they say of the sticks.
struct SharedStreamHead {
    std::array<char, 2048> text{};  ///< ends with 0
    std::uint64_t has_tip = 0, has_shaft = 0;
    std::array<double, 3> tip{}, shaft{};  ///< body frame [m]
};

/// What a sensor process and its hub share of one stick.
struct SensorMemory {
    std::uint64_t version = 0;  ///< StickState::kVersion of who made it
    tracking::NewestValue<tracking::StickState> state;
    tracking::NewestValue<SensorReport> report;
    tracking::NewestValue<SharedStreamHead> head;
};

/// A SensorMemory in POSIX shared memory, unmapped at the end.
class SharedSensorMemory {
public:
    /// New memory of zeros, for this user alone. It has a name (musicworld.PID.N) only until it is mapped.
    /// Throws std::runtime_error.
    SharedSensorMemory();
    /// The memory of a descriptor that this process inherited; takes the descriptor over. Throws
    /// std::runtime_error, also for memory of another build.
    explicit SharedSensorMemory(int descriptor);
    ~SharedSensorMemory();
    SharedSensorMemory(SharedSensorMemory&& other) noexcept;
    SharedSensorMemory& operator=(SharedSensorMemory&&) = delete;

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }
    [[nodiscard]] SensorMemory& operator*() const { return *memory_; }
    [[nodiscard]] SensorMemory* operator->() const { return memory_; }

private:
    void map();

    FileDescriptor descriptor_;
    SensorMemory* memory_ = nullptr;
};

/// Removes shared memory that programs of this user left when they were killed between naming and mapping it.
void sweep_left_memory() noexcept;

}  // namespace app
