#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sensors/sensor_hub.h"
#include "sensors/sensor_memory.h"

namespace app {

/// What there is to tell the user of sensors, once each: told from one look at their memory to the next.
class SensorWatch {
public:
    SensorWatch(std::vector<std::string> sticks, std::int64_t epoch_ns);

    /// Silence and its end: no state for 100 ms or 3 intervals between samples, whichever is longer.
    void stick(std::size_t stick, const std::optional<tracking::StickState>& state,
               const SensorReport& report, std::vector<SensorEvent>& events);
    /// Jumps of the source's clock, malformed messages.
    void source(const std::vector<std::size_t>& sticks, const SensorReport& report,
                std::vector<SensorEvent>& events);

    [[nodiscard]] SensorEvent ended(const std::vector<std::size_t>& sticks, const SensorReport& report) const;
    [[nodiscard]] SensorEvent failed(const std::vector<std::size_t>& sticks, const std::string& why) const;
    [[nodiscard]] SensorEvent restarted(const std::vector<std::size_t>& sticks, const std::string& how,
                                        std::size_t count, std::size_t most);

private:
    struct Stick {
        std::uint64_t samples = 0;
        std::int64_t heard_ns = 0;         ///< when the newest sample was read, or should have begun to come
        std::int64_t silent_since_ns = 0;  ///< 0: not silent
        std::uint64_t pid = 0;             ///< that the counts of the process below are of
        std::uint64_t jumps = 0, malformed = 0;
    };
    [[nodiscard]] SensorEvent event(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks,
                                    const std::string& text) const;
    void silence(std::size_t stick, const std::optional<tracking::StickState>& state, std::int64_t now_ns,
                 std::vector<SensorEvent>& events);

    std::vector<std::string> names_;
    std::int64_t epoch_ns_;
    std::vector<Stick> sticks_;
};

[[nodiscard]] ClockReport clock_report(const SensorReport& report);

}  // namespace app
