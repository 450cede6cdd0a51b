#include "sensors/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "files/recording_file.h"
#include "process/clock.h"
#include "process/stop_signals.h"

namespace app {
namespace {

constexpr std::int64_t kFlushEveryNs = 200'000'000;
constexpr double kGapIntervals = 2.5, kLeastGapS = 0.02;
constexpr double kIntervalSmoothing = 0.1;

class Recorder {
public:
    explicit Recorder(const RecordOptions& options)
        : options_(options), file_(options.out), source_(open_source(options.source)) {}

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
    struct Stick {
        RecordedStick told;
        double interval_s = 0;  // between samples, smoothed
    };

    [[nodiscard]] bool over(std::int64_t ns) const {
        return options_.seconds > 0 && first_ns_ != 0 &&
               static_cast<double>(ns - first_ns_) * 1e-9 >= options_.seconds;
    }

    void flush() {
        file_.flush();
        flushed_ns_ = monotonic_ns();
    }

    void take(const SourceSample& given) {
        if (first_ns_ == 0) begin(given);
        tracking::PoseSample sample = given.sample;
        sample.t_s = time_of(given);
        if (given.stick >= sticks_.size()) sticks_.resize(given.stick + 1);
        Stick& stick = sticks_[given.stick];
        stick.told.name = source_->sticks().names()[given.stick];
        if (stick.told.samples > 0 && !(sample.t_s > stick.told.last_s)) {
            ++result_.late;
            return;
        }
        note(stick, sample.t_s);
        file_.add(given.stick, stick.told.name, sample);
    }

    void begin(const SourceSample& first) {
        first_ns_ = first.read_ns;
        result_.clock = source_->replayed() ? "the trace's own, replayed"
                        : first.has_time    ? "the source's"
                                            : "arrival";
        if (source_->replayed())
            result_.estimate.offset_s =
                static_cast<double>(first.due_ns - options_.source.epoch_ns) * 1e-9 - first.sample.t_s;
        const SourceHead head = source_->head();
        tracking::Trace keys;
        keys.rate_hz = head.rate_hz;
        keys.tip = head.tip;
        keys.shaft = head.shaft;
        keys.source = fmt::format("recorded; clock of the times: {}{}", result_.clock,
                                  head.base_s == 0 ? "" : fmt::format(" minus {:.0f} s", head.base_s));
        if (!head.origin.empty()) keys.source += "; " + head.origin;
        file_.begin(keys, head.oriented);
    }

    /// The time that the recording says: the source's, unchanged but for jumps of its clock.
    double time_of(const SourceSample& given) {
        const double arrival_s = static_cast<double>(given.read_ns - first_ns_) * 1e-9;
        if (source_->replayed()) {
            delays_.add(static_cast<double>(given.read_ns - given.due_ns) * 1e-9);
            return given.sample.t_s;
        }
        if (!given.has_time) return arrival_s;
        (void)clock_.map(given.stick, given.sample.t_s, arrival_s);
        return given.sample.t_s + clock_.shift_s();
    }

    static void note(Stick& stick, double t_s) {
        RecordedStick& told = stick.told;
        const double interval_s = t_s - told.last_s;
        told.last_s = t_s;
        if (told.samples++ == 0) {
            told.first_s = t_s;
        } else if (stick.interval_s == 0) {
            stick.interval_s = interval_s;
        } else if (interval_s > std::max(kGapIntervals * stick.interval_s, kLeastGapS)) {
            ++told.gaps;
            told.longest_gap_s = std::max(told.longest_gap_s, interval_s);
        } else {
            stick.interval_s += kIntervalSmoothing * (interval_s - stick.interval_s);
        }
    }

    RecordResult finish() {
        for (const Stick& stick : sticks_) {
            if (stick.told.samples == 1) result_.alone.push_back(stick.told.name);
            if (stick.told.samples >= 2) result_.sticks.push_back(stick.told);
        }
        result_.faults = source_->faults();
        const ClockEstimate estimate = clock_.estimate();
        if (source_->replayed())
            result_.estimate.delay_p95_s = delays_.p95();
        else if (result_.clock == "the source's")
            result_.estimate = estimate;
        if (result_.sticks.empty())
            throw std::runtime_error(fmt::format(
                "error: found no stick with two samples from {}, expected some{}", options_.source.source,
                result_.faults.first.empty() ? "" : "; " + result_.faults.first));
        file_.finish();
        return std::move(result_);
    }

    const RecordOptions& options_;
    RecordingFile file_;
    std::unique_ptr<SampleSource> source_;
    SourceClock clock_;
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
