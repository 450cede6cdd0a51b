#include "sensors/sample_source.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "files/assets.h"
#include "files/bad_input.h"
#include "process/clock.h"
#include "sensors/live_sources.h"

namespace app {
namespace {

constexpr std::string_view kTrace = "trace:", kStream = "stdin", kZmq = "zmq:", kOsc = "osc:";

bool is_word(std::string_view name) {
    return !name.empty() && name.size() <= StickNames::kLongestName &&
           std::all_of(name.begin(), name.end(),
                       [](char c) { return c > ' ' && c < 0x7f && c != ',' && c != '"' && c != '\''; });
}

std::vector<std::string> names_of(const tracking::Trace& trace) {
    std::vector<std::string> names;
    for (const tracking::StickTrace& stick : trace.sticks) names.push_back(stick.name);
    return names;
}

const tracking::StickTrace& stick_called(const tracking::Trace& trace, const std::string& name) {
    const auto found = std::ranges::find(trace.sticks, name, &tracking::StickTrace::name);
    if (found != trace.sticks.end()) return *found;
    throw BadInput(fmt::format("{}: error: found no stick \"{}\", expected one of {}", trace.file, name,
                               fmt::join(names_of(trace), ", ")));
}

/// A trace replayed at its own times: sample i of lap k is due at
///
///   epoch + (k period + t_i - t0) / speed,   t0 the earliest time of all sticks of the trace
///
/// Every sample of the sticks asked for comes, in order of time, those of one time in order of the sticks.
class TraceSource final : public SampleSource {
public:
    /// `file`: a path, or the name of a bundled trace. Throws BadInput, tracking::TraceError.
    TraceSource(const std::string& file, const SourceOptions& options) : options_(options) {
        const tracking::Trace trace = tracking::read_trace(find_trace(file));
        const std::vector<std::string> wanted = options.sticks.empty() ? names_of(trace) : options.sticks;
        names_ = StickNames(wanted);
        t0_s_ = trace.t0_s();
        head_ = {trace, false, 0};
        head_.keys.sticks.clear();
        for (std::size_t i = 0; i < wanted.size(); ++i)
            for (const tracking::PoseSample& sample : stick_called(trace, wanted[i]).samples) {
                rows_.push_back({i, sample});
                head_.oriented = head_.oriented || sample.has_orientation;
            }
        // A stick's times differ. (stable_sort's buffer is not aligned for what holds Eigen's types.)
        std::ranges::sort(rows_, {}, [](const Row& row) { return std::tuple(row.sample.t_s, row.stick); });
        if (options_.period_s > 0 && !(options_.period_s > trace.t_end_s() - t0_s_))
            throw BadInput(fmt::format("{}: error: found a period of {} s, expected more than its {} s",
                                       trace.file, options_.period_s, trace.t_end_s() - t0_s_));
        if (options_.resume) skip_until(monotonic_ns());
    }

    [[nodiscard]] SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) override {
        if (next_ == rows_.size()) return SourceStatus::ended;
        const Row& row = rows_[next_];
        const std::int64_t due = due_ns(row);
        sleep_until_ns(std::min(due, deadline_ns));
        const std::int64_t now = monotonic_ns();
        if (now < due) return SourceStatus::waiting;
        sample = {row.stick, row.sample, true, lap_, due, now};
        pass_on();
        return SourceStatus::sample;
    }
    [[nodiscard]] const StickNames& sticks() const override { return names_; }
    [[nodiscard]] SourceHead head() const override { return head_; }
    [[nodiscard]] bool replayed() const override { return true; }
    [[nodiscard]] std::int64_t quiet_until_ns() const override {
        return next_ == 0 && !rows_.empty() ? due_ns(rows_[0]) : 0;  // before it begins, and between laps
    }
    [[nodiscard]] std::uint64_t passed_over(std::size_t stick, std::uint64_t lap,
                                            std::optional<double> t_s) const override {
        const auto end = rows_.begin() + static_cast<std::ptrdiff_t>(next_);
        const auto count = [&](auto last, double until_s) {
            return static_cast<std::uint64_t>(std::count_if(rows_.begin(), last, [&](const Row& row) {
                return row.stick == stick && row.sample.t_s <= until_s;
            }));
        };
        constexpr double kAll = std::numeric_limits<double>::infinity();
        const std::uint64_t a_lap = count(rows_.end(), kAll);
        const std::uint64_t given = t_s ? lap * a_lap + count(rows_.end(), *t_s) : 0;
        const std::uint64_t gone = lap_ * a_lap + count(end, kAll);
        return gone > given ? gone - given : 0;
    }

private:
    struct Row {
        std::size_t stick;
        tracking::PoseSample sample;
    };
    [[nodiscard]] std::int64_t due_ns(const Row& row) const {
        const double since_epoch_s = static_cast<double>(lap_) * options_.period_s + (row.sample.t_s - t0_s_);
        return options_.epoch_ns + to_ns(since_epoch_s / options_.speed);
    }

    void pass_on() {
        ++next_;
        if (next_ == rows_.size() && options_.period_s > 0) {
            next_ = 0;
            ++lap_;
        }
    }

    void skip_until(std::int64_t now_ns) {
        if (options_.period_s > 0) {  // not lap by lap through the night
            const double since_epoch_s = to_s(now_ns - options_.epoch_ns) * options_.speed;
            lap_ = static_cast<std::uint64_t>(std::max(0.0, std::floor(since_epoch_s / options_.period_s)));
        }
        while (next_ < rows_.size() && due_ns(rows_[next_]) < now_ns) pass_on();
    }

    SourceOptions options_;
    SourceHead head_;
    StickNames names_;
    std::vector<Row> rows_;
    double t0_s_ = 0;
    std::size_t next_ = 0;
    std::uint64_t lap_ = 0;
};

}  // namespace

std::optional<std::size_t> StickNames::index_of(std::string_view name) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
    if (!open_ || names_.size() == kMostSticks || !is_word(name)) return std::nullopt;
    names_.emplace_back(name);
    return names_.size() - 1;
}

bool serves_all_sticks(const std::string& source) {
    return !source.starts_with(kTrace);
}

void check_source(const SourceOptions& options) {
    if (options.source.starts_with(kOsc))
        check_osc_port(options.source.substr(kOsc.size()));
    else if (options.source != kStream)
        (void)open_source(options);
    if (options.sticks.size() > StickNames::kMostSticks)
        throw BadInput(fmt::format("error: found {} sticks, expected at most {}", options.sticks.size(),
                                   StickNames::kMostSticks));
}

std::unique_ptr<SampleSource> open_source(const SourceOptions& options) {
    const std::string& source = options.source;
    if (source.starts_with(kTrace))
        return std::make_unique<TraceSource>(source.substr(kTrace.size()), options);
    if (source == kStream) return make_stream_source(STDIN_FILENO, options);
    if (source.starts_with(kZmq)) return make_zmq_source(source.substr(kZmq.size()), options);
    if (source.starts_with(kOsc)) return std::make_unique<OscSource>(source.substr(kOsc.size()), options);
    throw BadInput(fmt::format(
        "error: found source \"{}\", expected trace:FILE, stdin, zmq:ENDPOINT or osc:PORT", source));
}

}  // namespace app
