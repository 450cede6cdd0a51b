#include "sensors/sensor_hub.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <filesystem>
#include <stdexcept>

#include "process/child_process.h"
#include "process/clock.h"
#include "sensors/sensor_process.h"
#include "sensors/sensor_memory.h"
#include "sensors/sensor_watch.h"

namespace app {
namespace {

constexpr std::size_t kMostRestarts = 5;
constexpr std::int64_t kRestartWindowNs = 10'000'000'000;
constexpr std::int64_t kReadyWithinNs = 10'000'000'000;
constexpr std::int64_t kFarewellNs = 500'000'000;
constexpr std::int64_t kLookEveryNs = 1'000'000;

[[noreturn]] void fail(const char* what) {
    throw std::runtime_error(fmt::format("error: found that making {} failed ({}), expected it to work", what,
                                         std::strerror(errno)));
}

/// A pipe and an eventfd that the sensors inherit. The pipe ends with this process, however that ends.
struct Links {
    int wake = -1, life[2] = {-1, -1};

    Links() : wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
        if (wake < 0) fail("an eventfd");
        if (pipe2(life, O_CLOEXEC) != 0) {
            close(wake);
            fail("a pipe");
        }
    }
    ~Links() {
        close(wake);
        close(life[0]);
        close_life();
    }
    Links(const Links&) = delete;
    Links& operator=(const Links&) = delete;
    void close_life() {
        if (life[1] >= 0) close(life[1]);
        life[1] = -1;
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
        task.predictors = {options.picture_predictor, options.sound_predictor, options.confirming_predictor};
        task.wake_fd = links.wake;
        task.life_fd = links.life[0];
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
        child.inherited.insert(child.inherited.end(), {links.wake, links.life[0]});
        sensor.pid = start_child(child);
    }

    [[nodiscard]] SensorReport report_of(const HubSensor& sensor) const {
        return memory[sensor.sticks.front()]->report.read().value_or(SensorReport{});
    }

    void wait_until_ready() {
        const std::int64_t until = monotonic_ns() + kReadyWithinNs;
        for (HubSensor& sensor : sensors)
            while (report_of(sensor).phase == SensorPhase::starting) {
                sleep_until_ns(monotonic_ns() + kLookEveryNs);
                collect(sensor);
                if (report_of(sensor).phase != SensorPhase::starting) break;
                if (sensor.pid < 0)
                    fail_start(
                        fmt::format("error: found that a sensor {}, expected it to run", how(sensor.status)));
                if (monotonic_ns() > until)
                    fail_start("error: found a sensor not ready after 10 s, expected it to run");
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
        links.close_life();
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
    require_motion({options.picture_predictor, options.sound_predictor, options.confirming_predictor});
    check_source({options.source, options.sticks, options.epoch_ns, options.period_s, 1, false});
    sweep_left_memory();
    implementation_ = std::make_unique<Implementation>(options);
}

SensorHub::~SensorHub() = default;

int SensorHub::wake_fd() const {
    return implementation_->links.wake;
}

void SensorHub::clear_wake() {
    std::uint64_t count = 0;
    (void)!read(implementation_->links.wake, &count, sizeof count);
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

std::string SensorHub::stream_head() const {
    const StreamHead head = implementation_->memory.front()->head.read().value_or(StreamHead{});
    return head.text.data();
}

int SensorHub::restarts() const {
    return implementation_->restarts;
}

}  // namespace app
