#include "filter/position_filter.h"

namespace tracking {

PositionFilter::PositionFilter(const MotionModel& model, double steady_rate_hz)
    : model_(model), now_{{}, model.initial_covariance()} {
    if (steady_rate_hz > 0) steady_ = steady_state(model, 1 / steady_rate_hz);
}

void PositionFilter::start(const Eigen::Vector3d& position) noexcept {
    now_ = {{to_lanes(position), Lanes::Zero(), Lanes::Zero()},
            steady_ ? steady_->covariance : model_.initial_covariance()};
}

}  // namespace tracking
