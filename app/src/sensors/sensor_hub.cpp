#include "sensors/sensor_hub.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "process/child_process.h"
#include "process/clock.h"
#include "sticks/external_predictor.h"
#include "sticks/learned_in_play.h"
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
constexpr std::int64_t kJumpsToldEveryNs = 1'000'000'000;
constexpr std::int64_t kApartForNs = 1'000'000'000;

std::string how(int status) {
    return WIFSIGNALED(status) ? fmt::format("was killed by signal {}", WTERMSIG(status))
                               : fmt::format("ended with status {}", WEXITSTATUS(status));
}

/// Takes note of a process that has ended.
void look_for_end(int& pid, int& status) {
    if (pid > 0 && waitpid(pid, &status, WNOHANG) == pid) pid = -1;
}

}  // namespace

SensorHub::SensorHub(const SensorOptions& options)
    : options_(options),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      memory_(options.sticks.size()),
      seen_(options.sticks.size()) {
    for (const std::string& name : {options.predictors.picture, options.predictors.sound})
        check_specification(name);
    check_source(options);
    if (!wake_) throw std::runtime_error("error: " + cannot("make an eventfd"));
    if (options_.program.empty()) options_.program = std::filesystem::read_symlink("/proc/self/exe").string();
    for (std::size_t i = 0; i < memory_.size(); ++i) {
        if (i == 0 || !serves_all_sticks(options_.source)) {
            sensors_.push_back({{options_, {}, wake_.get(), life_.out.get()}, FileDescriptor(), {}});
            sensors_.back().task.sticks.clear();
            if (options_.keep_learned) {
                sensors_.back().learned = FileDescriptor(memfd_create("learned", MFD_CLOEXEC));
                if (!sensors_.back().learned)
                    throw std::runtime_error("error: " + cannot("make memory for what is learned"));
                sensors_.back().task.learned_fd = sensors_.back().learned.get();
            }
        }
        sensors_.back().sticks.push_back(i);
        sensors_.back().task.sticks.push_back(options_.sticks[i]);
        sensors_.back().task.state_fds.push_back(memory_[i].descriptor());
    }
    for (Sensor& sensor : sensors_) start(sensor);
    wait_until_ready();
}

SensorHub::~SensorHub() {
    end_all();
}

void SensorHub::start(Sensor& sensor) const {
    for (const std::size_t stick : sensor.sticks) memory_[stick]->report.publish({});
    ChildStart child;
    child.command = sensor_arguments(sensor.task);
    child.command.insert(child.command.begin(), options_.program);
    child.own_group = options_.source != "stdin";  // a terminal lets only the foreground group read
    child.inherited = sensor.task.state_fds;
    child.inherited.insert(child.inherited.end(), {wake_.get(), life_.out.get()});
    if (sensor.learned) child.inherited.push_back(sensor.learned.get());
    sensor.pid = start_child(child);
}

SensorReport SensorHub::report_of(const Sensor& sensor) const {
    return memory_[sensor.sticks.front()]->report.read().value_or(SensorReport{});
}

void SensorHub::wait_until_ready() {
    // External predictors are started one after the other.
    const auto children = static_cast<double>(is_external(options_.predictors.picture) +
                                              is_external(options_.predictors.sound));
    const double ready_within_s = kReadyWithinS + children *
                                                      static_cast<double>(sensors_.front().sticks.size()) *
                                                      ExternalPatience{}.start_s;
    const std::int64_t until = monotonic_ns() + to_ns(ready_within_s);
    for (Sensor& sensor : sensors_) {
        SensorReport report;
        while ((report = report_of(sensor)).phase == SensorPhase::starting) {
            if (sensor.pid < 0)
                fail_start(
                    fmt::format("error: found that a sensor {}, expected it to run", how(sensor.status)));
            if (monotonic_ns() > until)
                fail_start(fmt::format("error: found a sensor not ready after {} s, expected it to run",
                                       ready_within_s));
            sleep_until_ns(monotonic_ns() + kLookEveryNs);
            look_for_end(sensor.pid, sensor.status);
        }
        if (report.phase == SensorPhase::failed) fail_start(report.text.data());
    }
}

void SensorHub::fail_start(const std::string& message) {
    end_all();
    throw std::runtime_error(message);
}

void SensorHub::add(SensorEvent::Kind kind, const std::vector<std::size_t>& sticks, const std::string& text) {
    SensorEvent event{kind, to_s(monotonic_ns() - options_.epoch_ns), {}, {}};
    for (const std::size_t stick : sticks) event.sticks.push_back(options_.sticks[stick]);
    event.message = fmt::format("sensor {}: {}", fmt::join(event.sticks, ", "), text);
    events_.push_back(std::move(event));
}

void SensorHub::fail(const Sensor& sensor, const std::string& why) {
    add(SensorEvent::Kind::failed, sensor.sticks, "failed: " + why);
}

/// What came since the last look, which ends a silence.
void SensorHub::hear(std::size_t index, const std::optional<tracking::StickState>& state) {
    SeenStick& stick = seen_[index];
    if (!state || state->samples == stick.samples) return;
    if (stick.silent_since_ns != 0)
        add(SensorEvent::Kind::back, {index},
            fmt::format("back after {:.2f} s", to_s(state->read_ns - stick.silent_since_ns)));
    stick.silent_since_ns = 0;
    stick.samples = state->samples;
    stick.heard_ns = std::max(stick.heard_ns, state->read_ns);
}

/// Silence and its end: no state for 100 ms or 3 intervals between samples, whichever is longer.
void SensorHub::watch_stick(std::size_t index) {
    const SensorReport report = memory_[index]->report.read().value_or(SensorReport{});
    if (report.phase != SensorPhase::running) return;
    SeenStick& stick = seen_[index];
    const std::optional<tracking::StickState> state = memory_[index]->state.read();
    const std::int64_t now = monotonic_ns();
    if (report.pid != stick.pid) stick.heard_ns = now;  // it has just begun
    stick.pid = report.pid;
    stick.heard_ns = std::max({stick.heard_ns, report.quiet_until_ns, options_.epoch_ns});
    hear(index, state);
    const std::int64_t patience =
        stick.samples == 0 ? kFirstSampleWithinNs
                           : std::max(kLeastSilenceNs, to_ns(kSilentIntervals * report.interval_s));
    if (stick.silent_since_ns != 0 || now - stick.heard_ns <= patience) return;
    stick.silent_since_ns = stick.heard_ns;
    add(SensorEvent::Kind::silent, {index},
        fmt::format("silent for {:.2f} s ({})", to_s(now - stick.heard_ns),
                    state ? fmt::format("last sample at {:.2f} s", to_s(state->read_ns - options_.epoch_ns))
                          : "no sample yet"));
}

/// Jumps of the stick's clock: not each of one that jumps all the time.
void SensorHub::watch_clock(std::size_t index) {
    const ClockEstimate clock = memory_[index]->report.read().value_or(SensorReport{}).clock.estimate;
    SeenStick& stick = seen_[index];
    const std::int64_t now = monotonic_ns();
    if (clock.jumps <= stick.jumps || now - stick.jump_told_ns < kJumpsToldEveryNs) return;
    stick.jumps = clock.jumps;
    stick.jump_told_ns = now;
    add(SensorEvent::Kind::clock_jumped, {index},
        fmt::format("the source's clock jumped by {:+.3f} s ({} so far); its offset is estimated anew",
                    clock.last_jump_s, clock.jumps));
}

/// True once, when `far` has held for a second.
bool SensorHub::lasts(bool far, std::int64_t& since_ns) {
    if (since_ns < 0) return false;
    const std::int64_t now = monotonic_ns();
    if (!far || since_ns == 0) since_ns = far ? now : 0;
    if (!far || now - since_ns < kApartForNs) return false;
    since_ns = -1;
    return true;
}

/// Clocks of senders that are far from each other's, and from this machine's.
void SensorHub::watch_clocks_of(const Sensor& sensor) {
    std::optional<std::size_t> first;
    double first_offset_s = 0;
    for (const std::size_t index : sensor.sticks) {
        const SensorReport report = memory_[index]->report.read().value_or(SensorReport{});
        const ClockReport& clock = report.clock;
        SeenStick& stick = seen_[index];
        if (report.read == 0 || clock.clock != SampleClock::source) continue;
        if (lasts(clock.wall && std::abs(clock.ahead_s) > kFarFromWallS, stick.far_from_ours_ns))
            add(SensorEvent::Kind::clocks_apart, {index},
                fmt::format("the source's clock is {:.3f} s {} this machine's", std::abs(clock.ahead_s),
                            clock.ahead_s > 0 ? "ahead of" : "behind"));
        if (!first) {
            first = index;
            first_offset_s = clock.estimate.offset_s;
            continue;
        }
        const double apart_s = std::abs(clock.estimate.offset_s - first_offset_s);
        if (lasts(apart_s > kFarApartS, stick.far_from_other_ns))
            add(SensorEvent::Kind::clocks_apart, {*first, index},
                fmt::format("their clocks are {:.3f} s apart; each is followed by itself", apart_s));
    }
}

/// Malformed messages.
void SensorHub::watch_source(const Sensor& sensor) {
    const SensorReport report = report_of(sensor);
    SeenStick& first = seen_[sensor.sticks.front()];
    if (report.malformed > 0 && first.malformed == 0)
        add(SensorEvent::Kind::malformed, sensor.sticks,
            fmt::format("left out what it could not read: {}", report.text.data()));
    first.malformed = std::max(first.malformed, report.malformed);
}

void SensorHub::look_after(Sensor& sensor) {
    if (sensor.over) return;
    look_for_end(sensor.pid, sensor.status);
    if (sensor.pid > 0) return;
    const SensorReport report = report_of(sensor);
    sensor.over = true;
    for (const std::size_t stick : sensor.sticks) hear(stick, memory_[stick]->state.read());
    if (report.phase == SensorPhase::ended)
        add(SensorEvent::Kind::ended, sensor.sticks,
            fmt::format("the source has ended{}",
                        sensor.sticks.size() == 1 ? fmt::format(" after {} samples", report.read) : ""));
    else if (report.phase == SensorPhase::failed)
        fail(sensor, report.text.data());
    else
        restart(sensor);
}

void SensorHub::restart(Sensor& sensor) {
    const std::int64_t now = monotonic_ns();
    std::deque<std::int64_t>& recent = sensor.restarts_ns;
    while (!recent.empty() && now - recent.front() > kRestartWindowNs) recent.pop_front();
    if (recent.size() == kMostRestarts) {
        fail(sensor, fmt::format("its process {} after {} restarts in 10 s; it is not started again",
                                 how(sensor.status), kMostRestarts));
        return;
    }
    recent.push_back(now);
    ++restarts_;
    sensor.task.resume = true;
    sensor.task.stall_at_s = -1;
    try {
        start(sensor);
        sensor.over = false;
        for (const std::size_t stick : sensor.sticks) seen_[stick].jumps = 0;
        add(SensorEvent::Kind::restarted, sensor.sticks,
            fmt::format("its process {}; started again ({} of at most {} times in 10 s)", how(sensor.status),
                        recent.size(), kMostRestarts));
    } catch (const std::runtime_error& wrong) {
        fail(sensor, wrong.what());
    }
}

void SensorHub::end_all() {
    life_.in.close();
    const std::int64_t until = monotonic_ns() + kFarewellNs;
    for (Sensor& sensor : sensors_) {
        for (look_for_end(sensor.pid, sensor.status); sensor.pid > 0 && monotonic_ns() < until;
             look_for_end(sensor.pid, sensor.status))
            sleep_until_ns(monotonic_ns() + kLookEveryNs);
        if (sensor.pid <= 0) continue;
        kill(sensor.pid, SIGKILL);
        (void)wait_for_child(sensor.pid);
        sensor.pid = -1;
    }
}

LearnedBySticks SensorHub::end_and_take_learned() {
    end_all();
    LearnedBySticks all;
    for (const Sensor& sensor : sensors_) {
        if (!sensor.learned) continue;
        struct stat found {};
        (void)fstat(sensor.learned.get(), &found);
        std::string bytes(static_cast<std::size_t>(found.st_size), '\0');
        bool whole = !bytes.empty() && pread(sensor.learned.get(), bytes.data(), bytes.size(), 0) ==
                                           static_cast<ssize_t>(bytes.size());
        try {
            if (whole)
                for (tracking::Experience& one : experiences_of(bytes))
                    all.experiences.push_back(std::move(one));
        } catch (const std::runtime_error&) {  // half of it
            whole = false;
        }
        if (!whole)
            for (const std::size_t stick : sensor.sticks) all.silent.push_back(options_.sticks[stick]);
    }
    return all;
}

void SensorHub::clear_wake() {
    std::uint64_t count = 0;
    (void)!read(wake_.get(), &count, sizeof count);
}

std::vector<SensorEvent> SensorHub::watch() {
    for (Sensor& sensor : sensors_) {
        const bool was_over = sensor.over;
        look_after(sensor);
        if (was_over) continue;
        watch_source(sensor);
        for (const std::size_t stick : sensor.sticks) watch_clock(stick);
        watch_clocks_of(sensor);
        if (sensor.over) continue;
        for (const std::size_t stick : sensor.sticks) watch_stick(stick);
    }
    return std::exchange(events_, {});
}

bool SensorHub::ended() const {
    return std::ranges::all_of(sensors_, [&](const Sensor& sensor) {
        return sensor.over || report_of(sensor).phase == SensorPhase::ended;
    });
}

std::vector<ClockReport> SensorHub::clocks() const {
    std::vector<ClockReport> clocks;
    for (const SharedSensorMemory& memory : memory_)
        clocks.push_back(memory->report.read().value_or(SensorReport{}).clock);
    return clocks;
}

}  // namespace app
