#include "sensors/sensor_hub.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <deque>
#include <filesystem>
#include <stdexcept>

#include "files/file_descriptor.h"
#include "process/child_process.h"
#include "process/clock.h"
#include "sensors/sensor_memory.h"
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

/// A pipe and an eventfd that the sensors inherit. The pipe ends with this process, however that ends.
struct Links {
    FileDescriptor wake = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    Pipe life = make_pipe();

    Links() {
        if (!wake) throw std::runtime_error("error: " + cannot("make an eventfd"));
    }
};

struct HubSensor {
    SensorTask task;
    std::vector<std::size_t> sticks;  ///< indices of the run
    int pid = -1;                     ///< -1: not running
    int status = 0;                   ///< of waitpid, once it has ended
    bool over = false;                ///< and will not be started again
    std::deque<std::int64_t> restarts_ns{};
};

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

SensorWatch::SensorWatch(std::vector<std::string> sticks, std::int64_t epoch_ns)
    : names_(std::move(sticks)), epoch_ns_(epoch_ns), sticks_(names_.size()) {}

SensorEvent SensorWatch::event(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks,
                               const std::string& text) const {
    SensorEvent event{kind, to_s(monotonic_ns() - epoch_ns_), {}, {}};
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
                      fmt::format("back after {:.2f} s", to_s(state->read_ns - stick.silent_since_ns))));
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
    const double lasts_s = to_s(now_ns - stick.heard_ns);
    events.push_back(event(SensorEvent::Kind::silent, {index},
                           state ? fmt::format("silent for {:.2f} s (last sample at {:.2f} s)", lasts_s,
                                               to_s(state->read_ns - epoch_ns_))
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

std::string how(int status) {
    return WIFSIGNALED(status) ? fmt::format("was killed by signal {}", WTERMSIG(status))
                               : fmt::format("ended with status {}", WEXITSTATUS(status));
}

}  // namespace

struct SensorHub::Implementation {
    SensorOptions options;
    Links links;
    std::vector<SharedSensorMemory> memory;  // one a stick
    std::vector<HubSensor> sensors;
    SensorWatch watch;
    int restarts = 0;

    explicit Implementation(const SensorOptions& given)
        : options(given), watch(given.sticks, given.epoch_ns) {
        if (options.program.empty())
            options.program = std::filesystem::read_symlink("/proc/self/exe").string();
        for (std::size_t i = 0; i < options.sticks.size(); ++i) memory.emplace_back();
        make_tasks();
        for (HubSensor& sensor : sensors) start(sensor);
        wait_until_ready();
    }
    ~Implementation() { end_all(); }
    Implementation(const Implementation&) = delete;
    Implementation& operator=(const Implementation&) = delete;

    void make_tasks() {
        if (serves_all_sticks(options.source)) {
            std::vector<std::size_t> all;
            for (std::size_t i = 0; i < options.sticks.size(); ++i) all.push_back(i);
            sensors.push_back({task_for(all), all});
        } else {
            for (std::size_t i = 0; i < options.sticks.size(); ++i) sensors.push_back({task_for({i}), {i}});
        }
    }
    [[nodiscard]] SensorTask task_for(const std::vector<std::size_t>& sticks) const {
        SensorTask task;
        task.source = {options.source, {}, options.epoch_ns, options.period_s, 1, false};
        for (const std::size_t stick : sticks) {
            task.source.sticks.push_back(options.sticks[stick]);
            task.state_fds.push_back(memory[stick].descriptor());
        }
        task.predictors = options.predictors;
        task.wake_fd = links.wake.get();
        task.life_fd = links.life.out.get();
        task.stall_at_s = options.stall_at_s;
        task.stall_s = options.stall_s;
        task.realtime = options.realtime;
        return task;
    }

    void start(HubSensor& sensor) {
        for (const std::size_t stick : sensor.sticks) memory[stick]->report.publish({});
        ChildStart child;
        child.command = sensor_arguments(sensor.task);
        child.command.insert(child.command.begin(), options.program);
        child.own_group = options.source != "stdin";  // a terminal lets only the foreground group read
        child.inherited = sensor.task.state_fds;
        child.inherited.insert(child.inherited.end(), {links.wake.get(), links.life.out.get()});
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
        for (HubSensor& sensor : sensors)
            while (report_of(sensor).phase == SensorPhase::starting) {
                sleep_until_ns(monotonic_ns() + kLookEveryNs);
                collect(sensor);
                if (report_of(sensor).phase != SensorPhase::starting) break;
                if (sensor.pid < 0)
                    fail_start(
                        fmt::format("error: found that a sensor {}, expected it to run", how(sensor.status)));
                if (monotonic_ns() > until)
                    fail_start(fmt::format("error: found a sensor not ready after {} s, expected it to run",
                                           ready_within_s()));
            }
        for (const HubSensor& sensor : sensors)
            if (const SensorReport report = report_of(sensor); report.phase == SensorPhase::failed)
                fail_start(report.text.data());
    }
    [[noreturn]] void fail_start(const std::string& message) {
        end_all();
        throw std::runtime_error(message);
    }

    /// Takes note of a process that has ended.
    static void collect(HubSensor& sensor) {
        if (sensor.pid > 0 && waitpid(sensor.pid, &sensor.status, WNOHANG) == sensor.pid) sensor.pid = -1;
    }

    void look_after(HubSensor& sensor, std::vector<SensorEvent>& events) {
        if (sensor.over) return;
        collect(sensor);
        if (sensor.pid > 0) return;
        const SensorReport report = report_of(sensor);
        sensor.over = true;
        if (report.phase == SensorPhase::ended)
            events.push_back(watch.ended(sensor.sticks, report));
        else if (report.phase == SensorPhase::failed)
            events.push_back(watch.failed(sensor.sticks, report.text.data()));
        else
            restart(sensor, events);
    }

    void restart(HubSensor& sensor, std::vector<SensorEvent>& events) {
        const std::int64_t now = monotonic_ns();
        std::deque<std::int64_t>& recent = sensor.restarts_ns;
        while (!recent.empty() && now - recent.front() > kRestartWindowNs) recent.pop_front();
        if (recent.size() == kMostRestarts) {
            events.push_back(
                watch.failed(sensor.sticks,
                             fmt::format("its process {} after {} restarts in 10 s; it is not started again",
                                         how(sensor.status), kMostRestarts)));
            return;
        }
        recent.push_back(now);
        ++restarts;
        sensor.task.source.resume = true;
        sensor.task.stall_at_s = -1;
        try {
            start(sensor);
            sensor.over = false;
            events.push_back(
                watch.restarted(sensor.sticks, how(sensor.status), recent.size(), kMostRestarts));
        } catch (const std::runtime_error& wrong) {
            events.push_back(watch.failed(sensor.sticks, wrong.what()));
        }
    }

    void end_all() {
        links.life.in.close();
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
    check_source({options.source, options.sticks, options.epoch_ns, options.period_s, 1, false});
    sweep_left_memory();
    implementation_ = std::make_unique<Implementation>(options);
}

SensorHub::~SensorHub() = default;

int SensorHub::wake_fd() const {
    return implementation_->links.wake.get();
}

void SensorHub::clear_wake() {
    std::uint64_t count = 0;
    (void)!read(implementation_->links.wake.get(), &count, sizeof count);
}

std::optional<tracking::StickState> SensorHub::newest(std::size_t stick) const noexcept {
    return implementation_->memory[stick]->state.read();
}

std::vector<SensorEvent> SensorHub::watch() {
    Implementation& own = *implementation_;
    std::vector<SensorEvent> events;
    for (HubSensor& sensor : own.sensors) {
        const bool was_over = sensor.over;
        own.look_after(sensor, events);
        if (was_over) continue;
        own.watch.source(sensor.sticks, own.report_of(sensor), events);
        if (sensor.over) continue;
        for (const std::size_t stick : sensor.sticks)
            own.watch.stick(stick, own.memory[stick]->state.read(),
                            own.memory[stick]->report.read().value_or(SensorReport{}), events);
    }
    return events;
}

bool SensorHub::ended() const {
    return std::all_of(
        implementation_->sensors.begin(), implementation_->sensors.end(), [&](const HubSensor& sensor) {
            return sensor.over || implementation_->report_of(sensor).phase == SensorPhase::ended;
        });
}

std::vector<ClockReport> SensorHub::clocks() const {
    std::vector<ClockReport> clocks;
    for (const HubSensor& sensor : implementation_->sensors)
        clocks.push_back(clock_report(implementation_->report_of(sensor)));
    return clocks;
}

StreamHead SensorHub::stream_head() const {
    const SharedStreamHead shared = implementation_->memory.front()->head.read().value_or(SharedStreamHead{});
    StreamHead head{shared.text.data(), {}, {}};
    if (shared.has_tip != 0) head.tip = Eigen::Map<const Eigen::Vector3d>(shared.tip.data());
    if (shared.has_shaft != 0) head.shaft = Eigen::Map<const Eigen::Vector3d>(shared.shaft.data());
    return head;
}

int SensorHub::restarts() const {
    return implementation_->restarts;
}

}  // namespace app
