#include "outlier_gate.h"

#include <algorithm>

namespace tracking {
namespace {
constexpr int kPersisting = 3;
constexpr int kSettled = 2;
}  // namespace

bool OutlierGate::possible(const Eigen::Vector3d& step, double dt, double innovation,
                           double sigma) const noexcept {
    if (step.norm() > fastest_ * dt) return false;
    if (steps_ < kSettled || innovation <= sigmas_ * sigma) return true;
    const double speed = std::max(velocity_.norm(), speed_before_);
    return (step - velocity_ * dt).norm() <= 2 * speed * dt + strongest_ * dt * dt / 2;
}

OutlierGate::Verdict OutlierGate::judge(const Eigen::Vector3d& step, double dt, double innovation,
                                        double sigma) noexcept {
    if (sigmas_ > 0 && !possible(step, dt, innovation, sigma))
        return ++refused_ < kPersisting ? Verdict::refuse : Verdict::persists;
    refused_ = 0;
    steps_ = std::min(steps_ + 1, kSettled);
    speed_before_ = velocity_.norm();
    velocity_ = step / dt;
    return Verdict::pass;
}

void OutlierGate::restart() noexcept {
    refused_ = 0;
    steps_ = 0;
    velocity_.setZero();
    speed_before_ = 0;
}

}  // namespace tracking
