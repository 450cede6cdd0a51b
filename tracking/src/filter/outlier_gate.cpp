#include "filter/outlier_gate.h"

#include <algorithm>

namespace tracking {
namespace {
constexpr int kPersisting = 3;
constexpr int kSettled = 2;
constexpr double kFastest = 25;          // m/s, of a tracked hand or tip
constexpr double kStrongestMps2 = 3000;  // m/s^2, apart from contacts
constexpr double kFastestTurn = 120;     // rad/s, with room to spare for a wrist
}  // namespace

OutlierGate OutlierGate::of_positions(double sigmas) noexcept {
    return {sigmas, kFastest, kStrongestMps2};
}

OutlierGate OutlierGate::of_rotations(double sigmas) noexcept {
    return {sigmas, kFastestTurn, kStrongestMps2 / kLever};
}

bool OutlierGate::possible(const Eigen::Vector3d& step, double dt, double innovation_square,
                           double variance) const noexcept {
    const double furthest = fastest_ * dt;
    if (step.squaredNorm() > furthest * furthest) return false;
    if (steps_ < kSettled || innovation_square <= sigmas_ * sigmas_ * variance) return true;
    const double explained = 2 * std::max(speed_, speed_before_) * dt + strongest_ * dt * dt / 2;
    return (step - velocity_ * dt).squaredNorm() <= explained * explained;
}

OutlierGate::Verdict OutlierGate::judge_step(const Eigen::Vector3d& step, double dt, double innovation_square,
                                             double variance) noexcept {
    if (sigmas_ > 0 && !possible(step, dt, innovation_square, variance))
        return ++refused_ < kPersisting ? Verdict::refuse : Verdict::persists;
    refused_ = 0;
    steps_ = std::min(steps_ + 1, kSettled);
    velocity_ = step / dt;
    speed_before_ = speed_;
    speed_ = velocity_.norm();
    return Verdict::pass;
}

OutlierGate::Verdict OutlierGate::judge(const Eigen::Vector3d& measured, double dt, double innovation_square,
                                        double variance) noexcept {
    const Verdict verdict = judge_step(measured - taken_, dt, innovation_square, variance);
    if (verdict == Verdict::pass) taken_ = measured;
    return verdict;
}

void OutlierGate::restart(const Eigen::Vector3d& measured) noexcept {
    refused_ = 0;
    steps_ = 0;
    taken_ = measured;
    velocity_.setZero();
    speed_ = speed_before_ = 0;
}

}  // namespace tracking
