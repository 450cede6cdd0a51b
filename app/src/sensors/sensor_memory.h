#pragma once
#include <tracking/newest_value.h>
#include <tracking/stick_state.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "files/file_descriptor.h"
#include "sensors/source_clock.h"

namespace app {

enum class SensorPhase : std::uint64_t { starting, running, ended, failed };

/// Whose clock the times of samples are.
enum class SampleClock : std::uint64_t { replayed, source, arrival };

/// How a sensor process is, for its hub. One for each stick; what concerns the process is the same in all.
struct SensorReport {
    std::uint64_t pid = 0;
    SensorPhase phase = SensorPhase::starting;
    std::int64_t quiet_until_ns = 0;  ///< no sample is expected before
    double interval_s = 0;            ///< between the stick's samples, smoothed; 0: not known
    std::uint64_t read = 0;           ///< samples of the stick that the reader got
    std::uint64_t malformed = 0;      ///< messages or rows
    SampleClock clock = SampleClock::replayed;
    ClockEstimate estimate;
    std::array<char, 256> text{};  ///< why it failed, or what the first malformed message was; ends with 0

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

}  // namespace app
