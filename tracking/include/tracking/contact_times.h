#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>

#include "tracking/path_model.h"
#include "tracking/trace.h"

namespace tracking {

/// A plane in the world: a point of it [m], its unit normal towards where sticks come from.
struct Plane {
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitY();
};

/// When a tip will next meet a plane: a distribution over the time to it.
struct ContactTimes {
    static constexpr std::size_t kBins = 18;
    static constexpr double kBinS = 1.0 / 120, kHorizonS = kBins * kBinS;  ///< 0.15 s

    /// The probability of a contact before i kBinS; linear in between.
    std::array<double, kBins + 1> before{};

    [[nodiscard]] double probability() const noexcept { return before.back(); }
    [[nodiscard]] double probability_between(double from_s, double to_s) const noexcept;
    /// The time before which there is a contact with that probability [s]; infinite where it is never so great.
    [[nodiscard]] double reached_s(double probability) const noexcept;
    /// Half of the probability that there is a contact lies before this time [s].
    [[nodiscard]] double median_s() const noexcept;
};

/// The network's inputs for a tip, and the axes and the speed that they refer to: plain numbers.
struct TipView {
    static constexpr std::size_t kInputs = 88;
    Eigen::Vector3d tip = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();  ///< world, SI
    double cosine = 1, sine = 0;  ///< forward is the horizontal unit vector (cosine, 0, sine)
    double speed = 1;             ///< RMS of the recent motion [m/s]
    std::array<float, kInputs> inputs{};
};

class StickHistory;

/// The newest 0.25 s of a stick's tip. Allocates in its constructor only; look() takes about 1 us.
class TipHistory {
public:
    /// `shaft`: unit, hand to tip; `tip` [m]; both in the tracked body's frame.
    TipHistory(const Eigen::Vector3d& shaft, const Eigen::Vector3d& tip);
    TipHistory(TipHistory&& other) noexcept;
    TipHistory& operator=(TipHistory&& other) noexcept;
    ~TipHistory();

    void restart() noexcept;
    /// A sample newer than the ones before.
    void push(PoseSample sample) noexcept;
    /// Writes the network's inputs; false while fewer than three samples are held.
    [[nodiscard]] bool look(TipView& view) const noexcept;

private:
    Eigen::Vector3d tip_;
    std::unique_ptr<StickHistory> history_;
};

/// The answer of the network `model.contacts`, which must be there, for a plane. The probability is 0 where
/// the tip is beneath the plane, or farther above it than the mean speed covers in 0.25 s: the training has
/// no such planes. Allocates nothing.
///
///   x  the inputs of PathModel's network, for the tip in place of the tracked point; the plane's normal
///      (forward, up, across); the distance d over the speed v, within 0 and 0.25 s; asinh(d / v / 5 ms); the
///      13 mean velocities of the tip along the normal, over v
///   y  logits of 18 bins of 1/120 s and of "no contact"
[[nodiscard]] ContactTimes contact_times(const PathModel& model, const TipView& view,
                                         const Plane& plane) noexcept;

}  // namespace tracking
