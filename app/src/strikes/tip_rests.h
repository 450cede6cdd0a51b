#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace app {

/// A stick's tip that lies on a sounding instrument.
struct TipRest {
    double s = 0;  ///< time of the sample that shows it
    std::uint32_t stick = 0, instrument = 0;
};

/// Finds when a stick's tip chokes the instrument that it lies on, as a drummer stops a cymbal.
///
/// A tip rests on an instrument while it is at most 3 mm off its surface (or in it: in the air nothing stops
/// a stick) and within 5 mm of where it came to rest. Once it has rested for the instrument's hold time, it
/// ends the sound of strokes up to then, and, as long as it lies there, that of further strokes of other
/// sticks. A stroke that turns back at more than 8 x 5 mm / hold^2 (4 m/s^2 for 0.1 s) is no rest.
///
/// One thread. A pure function of the calls.
class TipRests {
public:
    /// hold_s: the hold time by instrument; 0: tips never choke it.
    TipRests(std::vector<double> hold_s, std::size_t sticks)
        : hold_s_(std::move(hold_s)),
          struck_s_(hold_s_.size(), -std::numeric_limits<double>::infinity()),
          rests_(hold_s_.size() * sticks) {}

    /// The filter of a stick starts anew.
    void restart(std::uint32_t stick);
    /// A note of a stroke sounds from then on.
    void struck(std::uint32_t instrument, double onset_s);
    /// The sample of a stick at s: its tip [m], world, and its distance from each instrument's surface grown by the tip's
    /// radius [m, signed].
    void sample(std::uint32_t stick, double s, const Eigen::Vector3d& tip,
                std::span<const double> clearance_m);
    /// Those found since the last call, in order.
    [[nodiscard]] std::vector<TipRest> take() { return std::exchange(found_, {}); }

private:
    struct Rest {
        double since_s;
        Eigen::Vector3d place;
    };
    std::vector<double> hold_s_;
    std::vector<double> struck_s_;            // by instrument: its newest stroke that no tip has ended yet
    std::vector<std::optional<Rest>> rests_;  // stick-major
    std::vector<TipRest> found_;
};

}  // namespace app
