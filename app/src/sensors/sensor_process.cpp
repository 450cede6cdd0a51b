#include "sensors/sensor_process.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "files/bad_input.h"
#include "process/bounded_queue.h"
#include "process/clock.h"
#include "process/thread_priority.h"
#include "sticks/learned_in_play.h"

namespace app {
namespace {

[[noreturn]] void fail_memory(const char* action) {
    throw std::runtime_error("error: " + cannot(action));
}

constexpr std::int64_t kSettlingNs = 250'000'000;
constexpr std::size_t kMostQueued = 256;  // samples of a stick on their way from the reader to its filters
constexpr int kReportEveryMs = 50;
constexpr double kSmoothing = 0.1;       // of the interval between samples
constexpr double kLongestIntervalS = 1;  // longer ones are pauses
constexpr double kMostLateS = 10;        // of a sample that is of use

void add_one(int eventfd) {
    const std::uint64_t one = 1;
    (void)!write(eventfd, &one, sizeof one);
}

/// Blocks SIGTERM in this thread and those it starts; readable when it came. A terminal's SIGINT and SIGHUP reach
/// the hub, too, whose end ends this process.
FileDescriptor make_signal_fd() {
    for (const int signal : {SIGINT, SIGHUP}) (void)std::signal(signal, SIG_IGN);
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ending, nullptr);
    return FileDescriptor(signalfd(-1, &ending, SFD_CLOEXEC | SFD_NONBLOCK));
}

/// Ends this process by SIGTERM, so that its hub sees an interruption.
void end_interrupted() {
    (void)std::signal(SIGTERM, SIG_DFL);
    sigset_t ending;
    sigemptyset(&ending);
    sigaddset(&ending, SIGTERM);
    (void)raise(SIGTERM);
    pthread_sigmask(SIG_UNBLOCK, &ending, nullptr);
}

class Sensor {
public:
    explicit Sensor(const SensorTask& task) : task_(task), changed_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
        for (const int descriptor : task.state_fds) sticks_.emplace_back(descriptor);
        report_.pid = static_cast<std::uint64_t>(getpid());
    }
    int run() {
        const FileDescriptor signals = make_signal_fd();
        report();
        try {
            open();
            start();
        } catch (const std::exception& wrong) {
            fail(wrong.what());
        }
        pollfd watched[] = {{changed_.get(), POLLIN, 0}, {task_.life_fd, 0, 0}, {signals.get(), POLLIN, 0}};
        while (phase_ == SensorPhase::running) {
            report();
            (void)poll(watched, std::size(watched), kReportEveryMs);
            if (watched[1].revents != 0 || watched[2].revents != 0) break;
            std::uint64_t ignored = 0;
            (void)!::read(changed_.get(), &ignored, sizeof ignored);
        }
        report();
        add_one(task_.wake_fd);
        stop();
        save_learned();
        report();
        interrupted_ = watched[2].revents != 0;
        return phase_ == SensorPhase::failed ? 1 : 0;
    }
    [[nodiscard]] bool interrupted() const { return interrupted_; }

private:
    struct Stick {
        explicit Stick(int descriptor)
            : memory(descriptor), state(memory->state.read().value_or(tracking::StickState{})) {}

        SharedSensorMemory memory;
        BoundedQueue<SourceSample> samples{kMostQueued};
        // Of the filters' thread:
        std::unique_ptr<StickFilters> filters;
        tracking::StickState state;
        std::uint64_t lap = 0;
        std::uint64_t missed = 0;  // samples while no process ran, which are still to be counted
        std::jthread thread;
        // Of the reader, for reports:
        double last_s = 0;  // when the newest sample was read
        std::uint64_t read = 0;
        double interval_s = 0;
        SourceClock clock;
        bool clocked = false;  // a sample has begun the clock
        ClockReport clock_report;
    };

    // The reader.

    void read(const std::stop_token& stop) {
        (void)set_thread_priority(ThreadRole::sensing, task_.realtime);
        try {
            SourceSample sample;
            while (!stop.stop_requested()) {
                const SourceStatus status = source_->next(sample, monotonic_ns() + kSourcePatienceNs);
                if (stall_if_due(stop)) sample.read_ns = monotonic_ns();
                if (status == SourceStatus::sample) pass(sample);
                if (status != SourceStatus::sample || monotonic_ns() - noted_ns_ > kSourcePatienceNs)
                    note_source();
                if (status == SourceStatus::ended) break;
            }
            if (stop.stop_requested()) return;  // which is no end of the source
            for (Stick& stick : sticks_) stick.samples.close();
        } catch (const std::exception& wrong) {
            fail(wrong.what());
        }
    }
    void pass(SourceSample sample) {
        note(sample);
        keep_head();
        if (settling(sample) || !put_on_our_clock(sample)) return;
        if (source_->quiet_until_ns() != 0) note_source();
        BoundedQueue<SourceSample>& samples = sticks_[sample.stick].samples;
        if (source_->replayed())
            (void)samples.push(sample);
        else
            (void)samples.try_push(sample);
    }
    /// True for what a live source with a clock of its own sends in the first moments. What had piled up before
    /// this process was ready arrives all at once and says nothing of the clocks' offset; it would be played
    /// late, too. So the first moments are left out.
    bool settling(const SourceSample& sample) {
        if (source_->replayed() || !sample.has_time) return false;
        if (first_read_ns_ == 0) first_read_ns_ = sample.read_ns;
        return sample.read_ns - first_read_ns_ < kSettlingNs;
    }
    /// False for a sample that cannot be of its stick's clock or is long past, and for the one that begins it: that
    /// may be a stray.
    bool put_on_our_clock(SourceSample& sample) {
        const double arrival_s = since_epoch_s(sample.read_ns);
        if (source_->replayed()) {
            delays_.add(to_s(sample.read_ns - sample.due_ns));
            replay_offset_s_ = since_epoch_s(sample.due_ns) - sample.sample.t_s -
                               static_cast<double>(sample.lap) * task_.period_s;
            return true;
        }
        Stick& stick = sticks_[sample.stick];
        const std::optional<double> ours_s =
            sample.has_time ? stick.clock.map(sample.sample.t_s, arrival_s) : arrival_s;
        {
            const std::lock_guard lock(mutex_);
            stick.clock_report.clock = sample.has_time ? SampleClock::source : SampleClock::arrival;
        }
        const bool begins = sample.has_time && !std::exchange(stick.clocked, true);
        if (!ours_s || begins || *ours_s < arrival_s - kMostLateS) return false;
        sample.sample.t_s = *ours_s;
        sample.due_ns = task_.epoch_ns + to_ns(*ours_s);
        return true;
    }
    void note(const SourceSample& sample) {
        Stick& stick = sticks_[sample.stick];
        const double now_s = since_epoch_s(sample.read_ns);
        const double interval_s = now_s - std::exchange(stick.last_s, now_s);
        const std::lock_guard lock(mutex_);
        if (stick.read++ == 0 || !(interval_s < kLongestIntervalS)) return;
        stick.interval_s += (stick.interval_s == 0 ? 1 : kSmoothing) * (interval_s - stick.interval_s);
    }
    void note_source() {
        noted_ns_ = monotonic_ns();
        keep_head();
        const SourceFaults faults = source_->faults();
        const std::lock_guard lock(mutex_);
        report_.malformed = faults.malformed;
        report_.set_text(one_line(faults.first, 240));
        for (Stick& stick : sticks_) note_clock(stick);
        const std::int64_t quiet_until_ns = source_->quiet_until_ns();
        if (std::exchange(report_.quiet_until_ns, quiet_until_ns) != quiet_until_ns) add_one(changed_.get());
    }
    void note_clock(Stick& stick) {
        ClockReport& report = stick.clock_report;
        if (source_->replayed()) {
            report.estimate = {replay_offset_s_, 0, delays_.p95(), 0, 0};
            return;
        }
        report.estimate = stick.clock.estimate();
        if (report.clock != SampleClock::source) return;
        const double reading_s = since_epoch_s(monotonic_ns()) - report.estimate.offset_s;
        const std::optional<double> ahead_s = ahead_of_wall(source_->head().base_s + reading_s);
        report.wall = ahead_s.has_value();
        report.ahead_s = ahead_s.value_or(0);
    }
    /// True if the reader was held up just now.
    bool stall_if_due(const std::stop_token& stop) {
        if (stalled_ || task_.stall_at_s < 0 || since_epoch_s(monotonic_ns()) < task_.stall_at_s)
            return false;
        const std::int64_t until = monotonic_ns() + to_ns(task_.stall_s);
        while (monotonic_ns() < until && !stop.stop_requested())
            sleep_until_ns(std::min(until, monotonic_ns() + kSourcePatienceNs));
        stalled_ = true;
        return true;
    }

    // The filters.

    void filter(Stick& stick, const std::stop_token& stop) {
        (void)set_thread_priority(ThreadRole::sensing, task_.realtime);
        try {
            SourceSample sample;
            while (!stop.stop_requested() && stick.samples.pop(sample)) take(stick, sample);
            if (!stop.stop_requested() && --filtering_ == 0 && phase_ == SensorPhase::running)
                phase_ = SensorPhase::ended;
            add_one(changed_.get());
        } catch (const std::exception& wrong) {
            fail(wrong.what());
        }
    }
    void take(Stick& stick, const SourceSample& sample) {
        if (sample.lap != stick.lap) stick.filters->begin_anew();
        stick.lap = sample.lap;
        const std::uint64_t before = stick.state.samples;
        (void)stick.filters->correct(sample.sample, stick.state);
        if (stick.state.samples != before) {
            stick.state.samples += std::exchange(stick.missed, 0);
            stick.state.lap = sample.lap;
            stick.state.due_ns = sample.due_ns;
            stick.state.read_ns = sample.read_ns;
            stick.state.filtered_ns = monotonic_ns();
        }
        stick.memory->state.publish(stick.state);
        if (stick.state.samples != before) add_one(task_.wake_fd);
    }

    // Start, end, reports.

    void report() {
        const std::lock_guard lock(mutex_);
        for (Stick& stick : sticks_) {
            SensorReport report = report_;
            report.phase = phase_;
            report.interval_s = stick.interval_s;
            report.clock = stick.clock_report;
            report.read = stick.read;
            if (!failure_.empty()) report.set_text(failure_);
            stick.memory->report.publish(report);
        }
    }
    /// The stream's key lines and header, for the hub and for the process that follows this one: in the shared
    /// memory before the first sample that they hold for.
    void keep_head() {
        const std::string text = source_->stream_head();
        if (text.empty() || text == head_ || text.size() >= SharedStreamHead{}.text.size()) return;
        head_ = text;
        const SourceHead said = source_->head();
        SharedStreamHead head;
        std::copy(text.begin(), text.end(), head.text.begin());
        head.tip = said.keys.tip;
        head.shaft = said.keys.shaft;
        sticks_.front().memory->head.publish(head);
    }
    /// The source, and the filters, of which external ones are processes.
    void open() {
        SourceOptions options = task_;
        if (options.resume)
            if (const std::optional<SharedStreamHead> head = sticks_.front().memory->head.read())
                options.stream_head = head->text.data();
        source_ = open_source(options);
        const std::vector<std::string>& names = source_->sticks().names();
        if (names.size() != sticks_.size())
            throw std::runtime_error(
                "error: found sticks without shared memory, expected some for each stick");
        for (std::size_t i = 0; i < sticks_.size(); ++i) {
            sticks_[i].filters = std::make_unique<StickFilters>(task_.predictors, names[i]);
            // What a replay passed over after the newest state of the process before this one.
            const tracking::StickState& state = sticks_[i].state;
            const auto newest_s = state.samples > 0 ? std::optional(state.t_s) : std::nullopt;
            if (options.resume) sticks_[i].missed = source_->passed_over(i, state.lap, newest_s);
        }
        note_source();
    }
    void start() {
        phase_ = SensorPhase::running;
        filtering_ = sticks_.size();
        for (Stick& stick : sticks_)
            stick.thread = std::jthread([this, &stick](const std::stop_token& stop) { filter(stick, stop); });
        reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    }
    void stop() {
        reader_.request_stop();
        for (Stick& stick : sticks_) {
            stick.thread.request_stop();
            stick.samples.close();
        }
        reader_ = {};  // joins
        for (Stick& stick : sticks_) stick.thread = {};
    }
    /// After stop(). What cannot be written is not there for the hub, which says so.
    void save_learned() {
        if (task_.learned_fd < 0) return;
        std::vector<tracking::Experience> experiences;
        for (const Stick& stick : sticks_)
            if (stick.filters)
                if (std::optional<tracking::Experience> one = stick.filters->experience())
                    experiences.push_back(std::move(*one));
        const std::string bytes = bytes_of(experiences);
        (void)!ftruncate(task_.learned_fd, 0);
        (void)!pwrite(task_.learned_fd, bytes.data(), bytes.size(), 0);
    }
    void fail(const char* what) {
        {
            const std::lock_guard lock(mutex_);
            if (failure_.empty()) failure_ = one_line(what, 240);
        }
        phase_ = SensorPhase::failed;
        add_one(changed_.get());
    }
    [[nodiscard]] double since_epoch_s(std::int64_t ns) const { return to_s(ns - task_.epoch_ns); }

    const SensorTask& task_;
    std::deque<Stick> sticks_;
    std::unique_ptr<SampleSource> source_;
    std::int64_t first_read_ns_ = 0;  // of a live source; the reader's
    DelayPercentile delays_;          // of replayed samples; the reader's
    double replay_offset_s_ = 0;      // the reader's, as the next three
    std::string head_;
    std::int64_t noted_ns_ = 0;
    bool stalled_ = false;
    std::mutex mutex_;     // of what follows, and of the sticks' figures for reports
    SensorReport report_;  // what all sticks have in common
    std::string failure_;
    std::atomic<SensorPhase> phase_ = SensorPhase::starting;
    std::atomic<std::size_t> filtering_ = 0;  // sticks that still have samples to come
    FileDescriptor changed_;                  // eventfd: there is something to report
    bool interrupted_ = false;                // by SIGTERM
    std::jthread reader_;
};

}  // namespace

void SensorReport::set_text(std::string_view line) {
    text.fill(0);
    std::copy_n(line.data(), std::min(line.size(), text.size() - 1), text.data());
}

SharedSensorMemory::SharedSensorMemory() : descriptor_(memfd_create("musicworld", MFD_CLOEXEC)) {
    if (!descriptor_) fail_memory("make shared memory");
    if (ftruncate(descriptor_.get(), sizeof(SensorMemory)) != 0) fail_memory("size shared memory");
    map();
    memory_->version = tracking::StickState::kVersion;
}

SharedSensorMemory::SharedSensorMemory(int descriptor) : descriptor_(descriptor) {
    struct stat found {};
    const bool large_enough = fstat(descriptor, &found) == 0 && found.st_size == off_t{sizeof(SensorMemory)};
    if (large_enough) map();
    if (!large_enough || memory_->version != tracking::StickState::kVersion)
        throw std::runtime_error(
            "error: found no shared memory of this build, expected to be started by the program itself");
}

void SharedSensorMemory::map() {
    void* memory = mmap(nullptr, sizeof(SensorMemory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                        descriptor_.get(), 0);
    if (memory == MAP_FAILED) fail_memory("map shared memory");
    memory_.reset(static_cast<SensorMemory*>(memory));
}

void SharedSensorMemory::Unmap::operator()(SensorMemory* memory) const {
    munmap(memory, sizeof(SensorMemory));
}

int run_sensor(const SensorTask& task) {
    const rlimit no_core{0, 0};
    (void)setrlimit(RLIMIT_CORE, &no_core);
    bool interrupted = false;
    int status = 0;
    {
        Sensor sensor(task);
        status = sensor.run();
        interrupted = sensor.interrupted();
    }
    if (interrupted) end_interrupted();
    return status;
}

std::vector<std::string> sensor_arguments(const SensorTask& task) {
    std::vector<std::string> words = {"sensor"};
    const auto add = [&](const char* name, const auto& value) {
        const std::string text = fmt::format("{}", value);
        if (!text.empty()) words.push_back(fmt::format("{}={}", name, text));  // one word: it may be negative
    };
    const auto add_each = [&]<class Value>(const char* name, const std::vector<Value>& values) {
        for (const Value& value : values) add(name, value);
    };
    for_each_sensor_option(task, [&](const char* name, const auto& value, const char*) {
        if constexpr (requires { add_each(name, value); })
            add_each(name, value);
        else
            add(name, value);
    });
    return words;
}

}  // namespace app
