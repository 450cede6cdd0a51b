#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "filter/outlier_gate.h"
#include "tracking/trace.h"

namespace tracking {

/// Where a stick is and how it moves, and the axes and the unit of length of a network's inputs and outputs.
/// Both follow the recent motion, so that a network's answer does not depend on where the kit stands or which
/// way it faces. World frame, SI.
struct PathFrame {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
    /// Of the shaft, a unit vector from hand to tip, and its angular velocity [rad/s], which has no part
    /// about the shaft; both zero without orientations.
    Eigen::Vector3d direction = Eigen::Vector3d::Zero(), angular_velocity = Eigen::Vector3d::Zero();
    double cosine = 1, sine = 0;  ///< forward is the horizontal unit vector (cosine, 0, sine)
    double speed = 1;             ///< RMS of the recent motion [m/s], > 0

    [[nodiscard]] bool has_direction() const noexcept { return !direction.isZero(0); }
    /// A vector of the world in the axes (forward, up, across).
    [[nodiscard]] Eigen::Vector3f to_frame(const Eigen::Vector3d& v) const noexcept;
    [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& v) const noexcept;
    /// Where the tracked point and the shaft's direction would be `lead_s` later if their velocities faded at
    /// kFadingRate: what a network's answer is added to.
    [[nodiscard]] Eigen::Vector3d faded_position(double lead_s) const noexcept;
    [[nodiscard]] Eigen::Vector3d faded_direction(double lead_s) const noexcept;
};

/// The rate [1/s] at which extrapolated velocities fade, as in predictor `cv:decay=8`: the one with the least
/// errors.
inline constexpr double kFadingRate = 8;
/// The way that a unit velocity makes in `lead_s` while it fades [s].
[[nodiscard]] double fading_way(double lead_s) noexcept;

/// The newest 0.25 s of one stick, and the inputs of a network that follow from them.
///
/// The inputs, in the axes and the unit (speed) of the PathFrame:
///   - mean velocities of the tracked point between fixed ages (kAges), positions there being interpolated
///     linearly between samples, so that they mean the same at any rate;
///   - likewise the velocities of a second point, kLever along the shaft, relative to the tracked one;
///   - the shaft's direction, and 1 if it is known;
///   - log(speed / 1.5 m/s), the periods between the newest five samples over 1/60 s, at most 4 each, and the
///     part of the 0.25 s that the samples cover.
///
/// Forward is the principal direction of the horizontal motion of both points (the eigenvector of the greater
/// eigenvalue of their second moments), drawn towards the shaft's own horizontal direction by a share of the
/// motion's energy; it points where the shaft does, without a shaft to where the stick goes on its way down.
/// Allocates nothing; pushing is O(1), the inputs O(samples held).
class StickHistory {
public:
    static constexpr std::size_t kCapacity = 512;
    /// Ages between which velocities are taken [1/120 s].
    static constexpr std::array<int, 14> kAges = {0, 1, 2, 3, 4, 6, 8, 10, 12, 15, 18, 22, 26, 30};
    static constexpr std::size_t kSpans = kAges.size() - 1;
    static constexpr std::size_t kVectors = 2 * kSpans + 1;  ///< inputs that are vectors; they come first
    static constexpr std::size_t kPeriods = 4;
    static constexpr std::size_t kInputs = 3 * kVectors + 1 + 1 + kPeriods + 1;
    using Inputs = Eigen::Matrix<float, static_cast<int>(kInputs), 1>;

    /// `shaft`: unit, hand to tip, in the tracked body's frame.
    explicit StickHistory(const Eigen::Vector3d& shaft) : shaft_(shaft) {}

    void restart() noexcept { held_ = 0; }
    /// A sample newer than the ones before; without orientation the shaft stays where it was.
    void push(const PoseSample& sample) noexcept;
    [[nodiscard]] std::size_t held() const noexcept { return held_; }
    /// Where the stick was at a time between two samples held; false for others. Without orientation
    /// `direction` is zero.
    [[nodiscard]] bool find(double t_s, Eigen::Vector3d& position, Eigen::Vector3d& direction) const noexcept;
    /// Writes the inputs; at least two samples must be held.
    [[nodiscard]] PathFrame look(Inputs& inputs) const noexcept;

private:
    struct Point {
        double t_s = 0;
        Eigen::Vector3d position = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
    };
    using Spans = std::array<Eigen::Vector3d, kSpans>;

    [[nodiscard]] const Point& back(std::size_t age) const noexcept {
        return ring_[(newest_ + kCapacity - age) % kCapacity];
    }
    void find_velocities(Spans& point, Spans& second) const noexcept;

    Eigen::Vector3d shaft_;
    std::array<Point, kCapacity> ring_;
    std::size_t newest_ = 0, held_ = 0;
};

}  // namespace tracking
