#include "sensors/record.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <tracking/trace_rows.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>

#include "files/bad_input.h"
#include "files/output_file.h"
#include "process/clock.h"
#include "process/stop_signals.h"

namespace app {
namespace {

constexpr std::int64_t kFlushEveryNs = 200'000'000;
constexpr double kGapIntervals = 2.5, kLeastGapS = 0.02;
constexpr double kIntervalSmoothing = 0.1;

/// Writes a native trace that grows: OUT.partial until finish(), kept from the first row on. What has been flushed
/// is a trace, up to its last complete line: a stick's first row waits for its second one, without which no trace
/// may have it.
class Recorder {
public:
    explicit Recorder(const RecordOptions& options) : options_(options), out_(options.out) {
        file_ = open_file(out_.partial(), O_WRONLY | O_CREAT | O_TRUNC);
        if (!file_)
            throw BadInput(
                fmt::format("{}: error: found no way to write it ({}), expected a file that may be written",
                            out_.partial().string(), std::strerror(errno)));
        source_ = open_source(options.source);
    }

    RecordResult run() {
        const StopSignals signals;
        flushed_ns_ = monotonic_ns();
        SourceSample sample;
        while (!StopSignals::stopped() && !over(monotonic_ns())) {
            const SourceStatus status = source_->next(sample, monotonic_ns() + kSourcePatienceNs);
            if (status == SourceStatus::ended) break;
            if (status == SourceStatus::sample && !over(sample.read_ns)) take(sample);
            if (monotonic_ns() - flushed_ns_ > kFlushEveryNs) flush();
        }
        return finish();
    }

private:
    struct Stick : RecordedStick {
        double interval_s = 0;  // between samples, smoothed
        SourceClock source_clock;
        bool met = false;  // a sample has come
    };
    struct Row {
        std::size_t stick;
        std::string text;
    };

    [[nodiscard]] bool over(std::int64_t ns) const {
        return options_.seconds > 0 && first_ns_ != 0 && to_s(ns - first_ns_) >= options_.seconds;
    }

    void flush() {
        flushed_ns_ = monotonic_ns();
        std::string text;
        std::erase_if(rows_, [&](const Row& row) {
            if (sticks_[row.stick].samples < 2) return false;
            text += row.text;
            return true;
        });
        if (text.empty()) return;
        if (!wrote_) text.insert(0, head_);
        wrote_ = true;
        out_.keep_partial();
        if (!file_.write(text))
            throw std::runtime_error(fmt::format(
                "{}: error: found no way to write on ({}), expected room; what was recorded until then "
                "is kept there",
                out_.partial().string(), std::strerror(errno)));
    }

    void take(const SourceSample& given) {
        if (first_ns_ == 0) begin(given);
        tracking::PoseSample sample = given.sample;
        if (given.stick >= sticks_.size()) sticks_.resize(given.stick + 1);
        Stick& stick = sticks_[given.stick];
        stick.name = source_->sticks().names()[given.stick];
        const std::optional<double> t_s = time_of(given, stick);
        sample.t_s = t_s.value_or(0);
        if (!t_s || (stick.samples > 0 && !(sample.t_s > stick.last_s))) {
            ++result_.late;
            return;
        }
        note(stick, sample.t_s);
        rows_.push_back({given.stick, {}});
        tracking::append_trace_row(rows_.back().text, stick.name, sample, oriented_);
    }

    void begin(const SourceSample& first) {
        first_ns_ = first.read_ns;
        clock_ = source_->replayed() ? SampleClock::replayed
                 : first.has_time    ? SampleClock::source
                                     : SampleClock::arrival;
        if (source_->replayed())
            replay_offset_s_ = to_s(first.due_ns - options_.source.epoch_ns) - first.sample.t_s;
        SourceHead head = source_->head();
        const std::string origin = std::exchange(head.keys.source, {});
        head.keys.source = fmt::format("recorded; clock of the times: {}{}", name_of(clock_),
                                       head.base_s == 0 ? "" : fmt::format(" minus {:.0f} s", head.base_s));
        if (!origin.empty()) head.keys.source += "; " + origin;
        oriented_ = head.oriented;
        head_ = tracking::format_trace_head(head.keys, oriented_);
    }

    /// The time that the recording says: the source's, unchanged but for jumps of its clock, and on the first
    /// stick's clock where the two are far apart. None for a sample that cannot be of its stick's clock.
    std::optional<double> time_of(const SourceSample& given, Stick& stick) {
        const double arrival_s = to_s(given.read_ns - first_ns_);
        if (source_->replayed()) {
            delays_.add(to_s(given.read_ns - given.due_ns));
            return given.sample.t_s;
        }
        if (!given.has_time) return arrival_s;
        if (!stick.source_clock.map(given.sample.t_s, arrival_s)) return std::nullopt;
        const double apart_s = to_recorded_s(stick.source_clock) - first_to_recorded_s_;
        if (!std::exchange(stick.met, true)) {
            if (!met_)
                first_to_recorded_s_ = to_recorded_s(stick.source_clock);
            else if (std::abs(apart_s) > kFarApartS)
                stick.apart_s = apart_s;
            met_ = true;
        }
        return given.sample.t_s + stick.source_clock.shift_s() + stick.apart_s;
    }

    /// Our time minus that which a stick's samples would have in the recording.
    static double to_recorded_s(const SourceClock& clock) {
        return clock.estimate().offset_s - clock.shift_s();
    }

    static void note(Stick& stick, double t_s) {
        const double interval_s = t_s - stick.last_s;
        stick.last_s = t_s;
        if (stick.samples++ == 0) {
            stick.first_s = t_s;
        } else if (stick.interval_s == 0) {
            stick.interval_s = interval_s;
        } else if (interval_s > std::max(kGapIntervals * stick.interval_s, kLeastGapS)) {
            ++stick.gaps;
            stick.longest_gap_s = std::max(stick.longest_gap_s, interval_s);
        } else {
            stick.interval_s += kIntervalSmoothing * (interval_s - stick.interval_s);
        }
    }

    RecordResult finish() {
        for (Stick& stick : sticks_) {
            if (stick.samples == 1) result_.alone.push_back(stick.name);
            if (stick.samples < 2) continue;
            stick.clock = clock_report(stick);
            result_.sticks.push_back(stick);
        }
        result_.faults = source_->faults();
        if (result_.sticks.empty())
            throw std::runtime_error(fmt::format(
                "error: found no stick with two samples from {}, expected some{}", options_.source.source,
                result_.faults.first.empty() ? "" : "; " + result_.faults.first));
        flush();
        if (!file_.close()) throw std::runtime_error("error: " + cannot("write " + out_.partial().string()));
        out_.finish();
        return std::move(result_);
    }

    [[nodiscard]] ClockReport clock_report(const Stick& stick) const {
        if (clock_ == SampleClock::replayed) return {clock_, {replay_offset_s_, 0, delays_.p95(), 0, 0}};
        if (clock_ == SampleClock::arrival) return {clock_};
        ClockReport report{clock_, stick.source_clock.estimate()};
        const double reading_s = to_s(monotonic_ns() - first_ns_) - report.estimate.offset_s;
        const std::optional<double> ahead_s = ahead_of_wall(source_->head().base_s + reading_s);
        report.wall = ahead_s.has_value();
        report.ahead_s = ahead_s.value_or(0);
        return report;
    }

    const RecordOptions& options_;
    OutputFile out_;
    FileDescriptor file_;
    bool wrote_ = false, oriented_ = true;
    std::string head_;
    std::vector<Row> rows_;  // not yet written
    std::unique_ptr<SampleSource> source_;
    SampleClock clock_ = SampleClock::source;
    double replay_offset_s_ = 0;
    bool met_ = false;  // the first stick's clock: it gives first_to_recorded_s_
    double first_to_recorded_s_ = 0;
    DelayPercentile delays_;
    std::vector<Stick> sticks_;
    RecordResult result_;
    std::int64_t first_ns_ = 0, flushed_ns_ = 0;
};

}  // namespace

RecordResult record(const RecordOptions& options) {
    check_source(options.source);
    return Recorder(options).run();
}

}  // namespace app
