#include "sensors/sensor_hub.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <deque>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "process/child_process.h"
#include "process/clock.h"
#include "sensors/sensor_process.h"
#include "sticks/external_predictor.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr std::size_t kMostRestarts = 5;
constexpr std::int64_t kRestartWindowNs = 10'000'000'000;
constexpr double kReadyWithinS = 10;
constexpr std::int64_t kFarewellNs = 1'500'000'000;  // more than an external predictor is given
constexpr std::int64_t kLookEveryNs = 1'000'000;
constexpr std::int64_t kLeastSilenceNs = 100'000'000;
constexpr std::int64_t kFirstSampleWithinNs = 2'000'000'000;  // a player may take the sticks up later
constexpr double kSilentIntervals = 3;

struct HubSensor {
    SensorTask task;
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
};

std::string how(int status) {
    return WIFSIGNALED(status) ? fmt::format("was killed by signal {}", WTERMSIG(status))
                               : fmt::format("ended with status {}", WEXITSTATUS(status));
}

}  // namespace

struct SensorHub::Implementation {
    SensorOptions options;
    // A pipe and an eventfd that the sensors inherit. The pipe ends with this process, however that ends.
    FileDescriptor wake = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    Pipe life = make_pipe();
    std::vector<SharedSensorMemory> memory;  // one for each stick, as the next
    std::vector<SeenStick> seen;
    std::vector<HubSensor> sensors;
    std::vector<SensorEvent> events;  // since the last watch()
    int restarts = 0;

    explicit Implementation(const SensorOptions& given)
        : options(given), memory(given.sticks.size()), seen(given.sticks.size()) {
        if (!wake) throw std::runtime_error("error: " + cannot("make an eventfd"));
        if (options.program.empty())
            options.program = std::filesystem::read_symlink("/proc/self/exe").string();
        for (std::size_t i = 0; i < memory.size(); ++i) {
            if (i == 0 || !serves_all_sticks(options.source)) {
                sensors.push_back({{options, {}, wake.get(), life.out.get()}, {}});
                sensors.back().task.sticks.clear();
            }
            sensors.back().sticks.push_back(i);
            sensors.back().task.sticks.push_back(options.sticks[i]);
            sensors.back().task.state_fds.push_back(memory[i].descriptor());
        }
        for (HubSensor& sensor : sensors) start(sensor);
        wait_until_ready();
    }
    ~Implementation() { end_all(); }
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    void start(HubSensor& sensor) const {
        for (const std::size_t stick : sensor.sticks) memory[stick]->report.publish({});
        ChildStart child;
        child.command = sensor_arguments(sensor.task);
        child.command.insert(child.command.begin(), options.program);
        child.own_group = options.source != "stdin";  // a terminal lets only the foreground group read
        child.inherited = sensor.task.state_fds;
        child.inherited.insert(child.inherited.end(), {wake.get(), life.out.get()});
        sensor.pid = start_child(child);
    }

    [[nodiscard]] SensorReport report_of(const HubSensor& sensor) const {
        return memory[sensor.sticks.front()]->report.read().value_or(SensorReport{});
    }

    /// External predictors are started one after the other.
    [[nodiscard]] double ready_within_s() const {
        const std::size_t children = (is_external(options.predictors.picture) ? 1U : 0U) +
                                     (is_external(options.predictors.sound) ? 1U : 0U);
        return kReadyWithinS +
               static_cast<double>(children * sensors.front().sticks.size()) * ExternalPatience{}.start_s;
    }

    void wait_until_ready() {
        const std::int64_t until = monotonic_ns() + to_ns(ready_within_s());
        for (HubSensor& sensor : sensors) {
            SensorReport report;
            while ((report = report_of(sensor)).phase == SensorPhase::starting) {
                if (sensor.pid < 0)
                    fail_start(
                        fmt::format("error: found that a sensor {}, expected it to run", how(sensor.status)));
                if (monotonic_ns() > until)
                    fail_start(fmt::format("error: found a sensor not ready after {} s, expected it to run",
                                           ready_within_s()));
                sleep_until_ns(monotonic_ns() + kLookEveryNs);
                collect(sensor);
            }
            if (report.phase == SensorPhase::failed) fail_start(report.text.data());
        }
    }
    [[noreturn]] void fail_start(const std::string& message) {
        end_all();
        throw std::runtime_error(message);
    }

    /// Takes note of a process that has ended.
    static void collect(HubSensor& sensor) {
        if (sensor.pid > 0 && waitpid(sensor.pid, &sensor.status, WNOHANG) == sensor.pid) sensor.pid = -1;
    }

    void add(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks, const std::string& text) {
        SensorEvent event{kind, to_s(monotonic_ns() - options.epoch_ns), {}, {}};
        for (const std::size_t stick : sticks) event.sticks.push_back(options.sticks[stick]);
        event.message = fmt::format("sensor {}: {}", fmt::join(event.sticks, ", "), text);
        events.push_back(std::move(event));
    }
    void fail(const HubSensor& sensor, const std::string& why) {
        add(SensorEvent::Kind::failed, sensor.sticks, "failed: " + why);
    }

    /// Silence and its end: no state for 100 ms or 3 intervals between samples, whichever is longer.
    void watch_stick(std::size_t index) {
        const SensorReport report = memory[index]->report.read().value_or(SensorReport{});
        if (report.phase != SensorPhase::running) return;
        SeenStick& stick = seen[index];
        const std::optional<tracking::StickState> state = memory[index]->state.read();
        const std::int64_t now = monotonic_ns();
        if (report.pid != stick.pid) stick.heard_ns = now;  // it has just begun
        stick.pid = report.pid;
        stick.heard_ns = std::max({stick.heard_ns, report.quiet_until_ns, options.epoch_ns});
        const std::uint64_t samples = state ? state->samples : 0;
        if (samples != stick.samples) {
            if (stick.silent_since_ns != 0)
                add(SensorEvent::Kind::back, {index},
                    fmt::format("back after {:.2f} s", to_s(state->read_ns - stick.silent_since_ns)));
            stick.silent_since_ns = 0;
            stick.samples = samples;
            stick.heard_ns = std::max(stick.heard_ns, state->read_ns);
        }
        const std::int64_t patience =
            samples == 0 ? kFirstSampleWithinNs
                         : std::max(kLeastSilenceNs, to_ns(kSilentIntervals * report.interval_s));
        if (stick.silent_since_ns != 0 || now - stick.heard_ns <= patience) return;
        stick.silent_since_ns = stick.heard_ns;
        add(SensorEvent::Kind::silent, {index},
            fmt::format("silent for {:.2f} s ({})", to_s(now - stick.heard_ns),
                        state
                            ? fmt::format("last sample at {:.2f} s", to_s(state->read_ns - options.epoch_ns))
                            : "no sample yet"));
    }

    /// Jumps of the source's clock, malformed messages.
    void watch_source(const HubSensor& sensor) {
        const SensorReport report = report_of(sensor);
        SeenStick& first = seen[sensor.sticks.front()];
        if (report.estimate.jumps > first.jumps)
            add(SensorEvent::Kind::clock_jumped, sensor.sticks,
                fmt::format(
                    "the source's clock jumped by {:+.3f} s ({} so far); its offset is estimated anew",
                    report.estimate.last_jump_s, report.estimate.jumps));
        if (report.malformed > 0 && first.malformed == 0)
            add(SensorEvent::Kind::malformed, sensor.sticks,
                fmt::format("left out what it could not read: {}", report.text.data()));
        first.jumps = report.estimate.jumps;
        first.malformed = std::max(first.malformed, report.malformed);
    }

    void look_after(HubSensor& sensor) {
        if (sensor.over) return;
        collect(sensor);
        if (sensor.pid > 0) return;
        const SensorReport report = report_of(sensor);
        sensor.over = true;
        if (report.phase == SensorPhase::ended)
            add(SensorEvent::Kind::ended, sensor.sticks,
                fmt::format("the source has ended{}",
                            sensor.sticks.size() == 1 ? fmt::format(" after {} samples", report.read) : ""));
        else if (report.phase == SensorPhase::failed)
            fail(sensor, report.text.data());
        else
            restart(sensor);
    }

    void restart(HubSensor& sensor) {
        const std::int64_t now = monotonic_ns();
        std::deque<std::int64_t>& recent = sensor.restarts_ns;
        while (!recent.empty() && now - recent.front() > kRestartWindowNs) recent.pop_front();
        if (recent.size() == kMostRestarts) {
            fail(sensor, fmt::format("its process {} after {} restarts in 10 s; it is not started again",
                                     how(sensor.status), kMostRestarts));
            return;
        }
        recent.push_back(now);
        ++restarts;
        sensor.task.resume = true;
        sensor.task.stall_at_s = -1;
        try {
            start(sensor);
            sensor.over = false;
            seen[sensor.sticks.front()].jumps = 0;
            add(SensorEvent::Kind::restarted, sensor.sticks,
                fmt::format("its process {}; started again ({} of at most {} times in 10 s)",
                            how(sensor.status), recent.size(), kMostRestarts));
        } catch (const std::runtime_error& wrong) {
            fail(sensor, wrong.what());
        }
    }

    void end_all() {
        life.in.close();
        const std::int64_t until = monotonic_ns() + kFarewellNs;
        for (HubSensor& sensor : sensors) {
            for (collect(sensor); sensor.pid > 0 && monotonic_ns() < until; collect(sensor))
                sleep_until_ns(monotonic_ns() + kLookEveryNs);
            if (sensor.pid <= 0) continue;
            kill(sensor.pid, SIGKILL);
            (void)wait_for_child(sensor.pid);
            sensor.pid = -1;
        }
    }
};

SensorHub::SensorHub(const SensorOptions& options) {
    for (const std::string& name : {options.predictors.picture, options.predictors.sound})
        check_specification(name);
    check_source(options);
    implementation_ = std::make_unique<Implementation>(options);
}

SensorHub::~SensorHub() = default;

int SensorHub::wake_fd() const {
    return implementation_->wake.get();
}

void SensorHub::clear_wake() {
    std::uint64_t count = 0;
    (void)!read(implementation_->wake.get(), &count, sizeof count);
}

std::optional<tracking::StickState> SensorHub::newest(std::size_t stick) const noexcept {
    return implementation_->memory[stick]->state.read();
}

std::vector<SensorEvent> SensorHub::watch() {
    Implementation& own = *implementation_;
    for (HubSensor& sensor : own.sensors) {
        const bool was_over = sensor.over;
        own.look_after(sensor);
        if (was_over) continue;
        own.watch_source(sensor);
        if (sensor.over) continue;
        for (const std::size_t stick : sensor.sticks) own.watch_stick(stick);
    }
    return std::exchange(own.events, {});
}

bool SensorHub::ended() const {
    return std::all_of(
        implementation_->sensors.begin(), implementation_->sensors.end(), [&](const HubSensor& sensor) {
            return sensor.over || implementation_->report_of(sensor).phase == SensorPhase::ended;
        });
}

std::vector<ClockReport> SensorHub::clocks() const {
    constexpr std::array<const char*, 3> kClocks = {"the trace's own, replayed", "the source's", "arrival"};
    static_assert(kClocks.size() == static_cast<std::size_t>(SampleClock::arrival) + 1);
    std::vector<ClockReport> clocks;
    for (const HubSensor& sensor : implementation_->sensors) {
        const SensorReport report = implementation_->report_of(sensor);
        const ClockEstimate& estimate = report.estimate;
        clocks.push_back({kClocks[static_cast<std::size_t>(report.clock)], estimate.offset_s,
                          estimate.drift_ppm, estimate.delay_p95_s * 1e3, static_cast<int>(estimate.jumps)});
    }
    return clocks;
}

StreamHead SensorHub::stream_head() const {
    const SharedStreamHead shared = implementation_->memory.front()->head.read().value_or(SharedStreamHead{});
    return {shared.text.data(), shared.tip, shared.shaft};
}

int SensorHub::restarts() const {
    return implementation_->restarts;
}

}  // namespace app
