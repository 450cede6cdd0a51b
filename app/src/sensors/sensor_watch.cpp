#include "sensors/sensor_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "process/clock.h"

namespace app {
namespace {

constexpr std::int64_t kLeastSilenceNs = 100'000'000;
constexpr std::int64_t kFirstSampleWithinNs = 2'000'000'000;  // a player may take the sticks up later
constexpr double kSilentIntervals = 3;

double seconds(std::int64_t ns) {
    return static_cast<double>(ns) * 1e-9;
}

}  // namespace

SensorWatch::SensorWatch(std::vector<std::string> sticks, std::int64_t epoch_ns)
    : names_(std::move(sticks)), epoch_ns_(epoch_ns), sticks_(names_.size()) {}

SensorEvent SensorWatch::event(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks,
                               const std::string& text) const {
    SensorEvent event{kind, seconds(monotonic_ns() - epoch_ns_), {}, {}};
    for (const std::size_t stick : sticks) event.sticks.push_back(names_[stick]);
    event.message = fmt::format("sensor {}: {}", fmt::join(event.sticks, ", "), text);
    return event;
}

void SensorWatch::stick(std::size_t index, const std::optional<tracking::StickState>& state,
                        const SensorReport& report, std::vector<SensorEvent>& events) {
    Stick& stick = sticks_[index];
    const std::int64_t now = monotonic_ns();
    if (report.phase != SensorPhase::running) return;
    if (report.pid != stick.pid) stick.heard_ns = now;  // it has just begun
    stick.pid = report.pid;
    stick.heard_ns = std::max({stick.heard_ns, report.quiet_until_ns, epoch_ns_});
    const std::uint64_t samples = state ? state->samples : 0;
    if (samples != stick.samples) {
        if (stick.silent_since_ns != 0)
            events.push_back(
                event(SensorEvent::Kind::back, {index},
                      fmt::format("back after {:.2f} s", seconds(state->read_ns - stick.silent_since_ns))));
        stick.silent_since_ns = 0;
        stick.samples = samples;
        stick.heard_ns = std::max(stick.heard_ns, state->read_ns);
    }
    const auto intervals_ns = std::llround(kSilentIntervals * report.interval_s * 1e9);
    const std::int64_t patience =
        samples == 0 ? kFirstSampleWithinNs : std::max<std::int64_t>(kLeastSilenceNs, intervals_ns);
    if (stick.silent_since_ns == 0 && now - stick.heard_ns > patience) silence(index, state, now, events);
}

void SensorWatch::silence(std::size_t index, const std::optional<tracking::StickState>& state,
                          std::int64_t now_ns, std::vector<SensorEvent>& events) {
    Stick& stick = sticks_[index];
    stick.silent_since_ns = stick.heard_ns;
    const double lasts_s = seconds(now_ns - stick.heard_ns);
    events.push_back(event(SensorEvent::Kind::silent, {index},
                           state ? fmt::format("silent for {:.2f} s (last sample at {:.2f} s)", lasts_s,
                                               seconds(state->read_ns - epoch_ns_))
                                 : fmt::format("silent for {:.2f} s (no sample yet)", lasts_s)));
}

void SensorWatch::source(const std::vector<std::size_t>& sticks, const SensorReport& report,
                         std::vector<SensorEvent>& events) {
    Stick& first = sticks_[sticks.front()];
    if (report.jumps > first.jumps)
        events.push_back(event(
            SensorEvent::Kind::clock_jumped, sticks,
            fmt::format("the source's clock jumped by {:+.3f} s ({} so far); its offset is estimated anew",
                        report.last_jump_s, report.jumps)));
    if (report.malformed > 0 && first.malformed == 0)
        events.push_back(event(SensorEvent::Kind::malformed, sticks,
                               fmt::format("left out what it could not read: {}", report.text.data())));
    first.jumps = report.jumps;
    first.malformed = std::max(first.malformed, report.malformed);
}

SensorEvent SensorWatch::ended(const std::vector<std::size_t>& sticks, const SensorReport& report) const {
    return event(SensorEvent::Kind::ended, sticks,
                 fmt::format("the source has ended{}",
                             sticks.size() == 1 ? fmt::format(" after {} samples", report.read) : ""));
}

SensorEvent SensorWatch::failed(const std::vector<std::size_t>& sticks, const std::string& why) const {
    return event(SensorEvent::Kind::failed, sticks, "failed: " + why);
}

SensorEvent SensorWatch::restarted(const std::vector<std::size_t>& sticks, const std::string& how,
                                   std::size_t count, std::size_t most) {
    sticks_[sticks.front()].jumps = 0;
    return event(
        SensorEvent::Kind::restarted, sticks,
        fmt::format("its process {}; started again ({} of at most {} times in 10 s)", how, count, most));
}

ClockReport clock_report(const SensorReport& report) {
    ClockReport clock;
    clock.clock = report.clock == SampleClock::replayed ? "the trace's own, replayed"
                  : report.clock == SampleClock::source ? "the source's"
                                                        : "arrival";
    clock.offset_s = report.offset_s;
    clock.drift_ppm = report.drift_ppm;
    clock.delay_p95_ms = report.delay_p95_ms;
    clock.jumps = static_cast<int>(report.jumps);
    return clock;
}

}  // namespace app
