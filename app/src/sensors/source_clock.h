#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace app {

/// The 95th percentile of the newest values.
class DelayPercentile {
public:
    void add(double value) noexcept { values_[count_++ % values_.size()] = value; }
    [[nodiscard]] double p95() const noexcept;
    void clear() noexcept { count_ = 0; }

private:
    std::array<double, 1024> values_{};
    std::size_t count_ = 0;
};

/// What is known of a source's clock.
struct ClockEstimate {
    double offset_s = 0;  ///< ours minus the source's, the least delay included, which cannot be told from it
    double drift_ppm = 0;    ///< of the source's clock against ours; 0 in the first seconds
    double delay_p95_s = 0;  ///< of arrival beyond the least delay
    std::uint64_t jumps = 0;
    double last_jump_s = 0;  ///< by which the source's clock jumped, > 0: forwards
};

/// Whose clock the times of samples are.
enum class SampleClock : std::uint64_t { replayed, source, arrival };
/// "the trace's own, replayed", "the source's" or "arrival".
[[nodiscard]] const char* name_of(SampleClock clock);

/// Beyond this two clocks are far from each other [s]: more than a sample is under way.
inline constexpr double kFarApartS = 0.25;
/// Beyond this a wall clock is far from this machine's [s]: one that is set from time to time is nearer.
inline constexpr double kFarFromWallS = 1;

/// How the clock of a stick's samples relates to ours, which counts from the epoch.
struct ClockReport {
    SampleClock clock = SampleClock::replayed;
    ClockEstimate estimate = {};
    /// Whether the source's times are wall time (NTP's of 1900 or Unix's of 1970), and by how much its clock is
    /// ahead of this machine's then, the least delay not counted.
    bool wall = false;
    double ahead_s = 0;
};

/// By how much a clock whose reading now is `reading_s` is ahead of this machine's wall clock, if it counts from
/// 1900 or 1970: if it is within a year of that.
[[nodiscard]] std::optional<double> ahead_of_wall(double reading_s) noexcept;

/// Puts the times of a stick's samples on our clock. Each stick has one: its sender may have a clock of its own.
///
/// Of each sample the arrival minus its own time is the clocks' offset and the delay on the way, which is
/// >= 0: the least of a window is the offset (one-way minimum filter: Paxson 1998, Cristian's lower bound
/// without the way back).
///
///   target     the least arrival - time of the newest 2 s
///   offset     starts at the first sample's; follows the target by at most half of the time that passes for
///              kSettlingS, then by at most 200 ppm of it: differences of mapped times stay true
///   mapped     sample's time + offset, strictly increasing for samples that come in order; never more than
///              kJumpS after the arrival
///   drift      slope of the least arrival - time of each second (least squares, 64 s)
///
/// A sample that lies before an older one is late, and so is its mapped time; one that would be mapped to more
/// than kJumpS after its arrival cannot be of this clock, and is not mapped. Three of one kind in a row, in
/// order among themselves, are a jump of the clock; so are samples that all come kJumpS later than they used
/// to for half a second. The offset is then estimated anew from that sample's arrival.
/// Bounded memory; no allocation. One thread.
class SourceClock {
public:
    static constexpr double kSettlingS = 0.25, kJumpS = 0.25;

    /// The sample's time on our clock; none for one that cannot be of this clock. `arrival_s` does not decrease.
    [[nodiscard]] std::optional<double> map(double source_s, double arrival_s) noexcept;
    [[nodiscard]] ClockEstimate estimate() const noexcept;
    /// What jumps have added to the source's times, so that these go on increasing: minus all jumps.
    [[nodiscard]] double shift_s() const noexcept { return shift_s_; }

private:
    static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
    struct Bucket {
        std::int64_t index = kNever;
        double least = 0;
    };
    enum class Fit { in_order, behind, ahead };

    [[nodiscard]] Fit fit(double source_s, double arrival_s) const noexcept;
    [[nodiscard]] bool strays_for_long(Fit fit, double source_s) noexcept;
    [[nodiscard]] bool stays_late(double delay, double arrival_s) noexcept;
    void begin(double source_s, double arrival_s) noexcept;
    void jump(double source_s, double arrival_s) noexcept;
    void take(double delay, double arrival_s) noexcept;
    void steer(double source_s) noexcept;
    [[nodiscard]] double target(double arrival_s) const noexcept;
    [[nodiscard]] double drift_ppm() const noexcept;

    std::array<Bucket, 20> window_{};   // of 0.1 s
    std::array<Bucket, 64> seconds_{};  // of 1 s
    DelayPercentile delays_;
    bool started_ = false;
    double offset_s_ = 0, target_s_ = 0;
    double begun_s_ = 0, newest_s_ = 0;  // source times
    Fit stray_ = Fit::in_order;          // of the newest samples in a row, in order among themselves:
    double stray_s_ = 0;                 // time of the last
    int strays_ = 0;
    double latest_mapped_s_ = 0;
    double late_since_s_ = -1;
    std::uint64_t jumps_ = 0;
    double last_jump_s_ = 0, shift_s_ = 0;
};

}  // namespace app
