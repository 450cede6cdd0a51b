#include "position_filter.h"

namespace tracking {

PositionFilter::PositionFilter(const MotionModel& model, double steady_rate_hz)
    : model_(model), p_(model.initial_covariance()) {
    if (steady_rate_hz > 0) steady_ = steady_state(model, 1 / steady_rate_hz);
}

void PositionFilter::start(const Eigen::Vector3d& position) noexcept {
    x_ = {to_lanes(position), Lanes::Zero(), Lanes::Zero()};
    p_ = steady_ ? steady_->covariance : model_.initial_covariance();
}

void PositionFilter::propagate(double dt) noexcept {
    const Transition f = model_.transition(dt);
    x_ = f * x_;
    p_ = propagated(p_, f, model_.process_noise(dt));
}

void PositionFilter::correct(const Lanes& innovation) noexcept {
    if (steady_) {
        add(x_, steady_->gain, innovation);
        p_ = steady_->covariance;
    } else {
        add(x_, tracking::correct(p_, model_.measurement_variance), innovation);
    }
}

}  // namespace tracking
