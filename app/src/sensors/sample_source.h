#pragma once
#include <tracking/trace.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// The sticks of a source by index: a given list, or as they come, at most kMostSticks.
class StickNames {
public:
    static constexpr std::size_t kMostSticks = 16, kLongestName = 64;

    /// Empty: as they come.
    explicit StickNames(std::vector<std::string> names = {})
        : names_(std::move(names)), open_(names_.empty()) {}

    /// None for a stick that was not asked for, one too many, or a name that is not a word.
    [[nodiscard]] std::optional<std::size_t> index_of(std::string_view name);
    [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

private:
    std::vector<std::string> names_;
    bool open_;
};

/// One report of a stick, as its source gave it.
struct SourceSample {
    std::size_t stick = 0;        ///< index among the source's sticks
    tracking::PoseSample sample;  ///< t_s on the source's own clock
    bool has_time = true;         ///< false: the source gave none, t_s is nothing
    std::uint64_t lap = 0;        ///< of a looped trace
    std::int64_t due_ns = 0;      ///< CLOCK_MONOTONIC at which a replayed sample was taken; 0: not replayed
    std::int64_t read_ns = 0;     ///< CLOCK_MONOTONIC when it was here
};

/// What a source sent that could not be used.
struct SourceFaults {
    std::uint64_t malformed = 0;  ///< messages or rows
    std::uint64_t foreign = 0;    ///< samples of sticks that were not asked for
    std::uint64_t lost = 0;       ///< samples for which there was no room
    std::string first;            ///< what was wrong with the first malformed one, one line
};

/// What a source says of all its samples.
struct SourceHead {
    tracking::Trace keys;  ///< its rate, tip, shaft and source, as far as they are known
    bool oriented = true;  ///< its samples may have orientations
    double base_s = 0;     ///< was taken from all its times, which count from long ago
};

enum class SourceStatus { sample, waiting, ended };

/// Where samples come from, at their own pace. One thread.
class SampleSource {
public:
    SampleSource() = default;
    SampleSource(const SampleSource&) = delete;
    SampleSource& operator=(const SampleSource&) = delete;
    virtual ~SampleSource() = default;
    /// The next sample, waiting for it until `deadline_ns` (CLOCK_MONOTONIC) at the longest. Throws
    /// tracking::TraceError or std::runtime_error, one line, when the source cannot go on.
    [[nodiscard]] virtual SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) = 0;
    [[nodiscard]] virtual const StickNames& sticks() const = 0;
    /// Complete once the first sample has come.
    [[nodiscard]] virtual SourceHead head() const = 0;
    [[nodiscard]] virtual SourceFaults faults() const { return {}; }
    /// Samples come from a recording and say when they are due.
    [[nodiscard]] virtual bool replayed() const { return false; }
    /// The lines of a stream without which the rest cannot be read, once they are complete, no later than the
    /// first sample that they hold for; empty for other sources.
    [[nodiscard]] virtual std::string stream_head() const { return {}; }
    /// How many samples of the stick lie after the one of time t_s in that lap and before the next one that
    /// this will give: those that a replay with `resume` has passed over. t_s: none where there was none.
    [[nodiscard]] virtual std::uint64_t passed_over(std::size_t /*stick*/, std::uint64_t /*lap*/,
                                                    std::optional<double> /*t_s*/) const {
        return 0;
    }
    /// There will be no sample before that time, and this is as it should be; 0: not known.
    [[nodiscard]] virtual std::int64_t quiet_until_ns() const { return 0; }
};

/// How a source is to be opened.
struct SourceOptions {
    std::string source;               ///< trace:FILE | stdin | zmq:ENDPOINT | osc:PORT
    std::vector<std::string> sticks;  ///< by index; empty: all, as they come
    std::int64_t epoch_ns = 0;        ///< CLOCK_MONOTONIC at which a trace's t0 is due
    double period_s = 0;  ///< a trace begins again this long after it began, > its duration; 0: never
    double speed = 1;     ///< of a replay
    bool resume = false;  ///< begin at the current time: samples of a trace that are due have been seen
    std::string stream_head = {};  ///< with `resume`: what stream_head() was
};

/// Throws BadInput for a source that does not exist, is not one, or lacks a stick that was asked for.
void check_source(const SourceOptions& options);

/// True if one process must serve all sticks, since the source delivers them together.
[[nodiscard]] bool serves_all_sticks(const std::string& source);

/// Opens it. Throws as check_source(); std::runtime_error when it cannot be opened now.
[[nodiscard]] std::unique_ptr<SampleSource> open_source(const SourceOptions& options);

/// So long before its epoch a replay is opened, so that its first sample is in time [ns].
inline constexpr std::int64_t kHeadStartNs = 20'000'000;
/// The longest time that next() may be asked to wait, so that the caller can be stopped [ns].
inline constexpr std::int64_t kSourcePatienceNs = 50'000'000;

}  // namespace app
