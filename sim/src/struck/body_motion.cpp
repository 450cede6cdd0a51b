#include "struck/body_motion.h"

namespace sim {

void BodyMotion::start(double t_s, const OscillatorState& now) {
    pieces_.clear();
    pieces_.push_back({t_s, now});
    bounds_ = {};
    at_rest_ = true;
    widen(now);
}

void BodyMotion::add(const Impulse& impulse) {
    OscillatorState kicked = model_->kick(impulse);
    const Piece& last = pieces_.back();
    if (impulse.t_s <= last.t_s) {
        pieces_.back().state.add(model_->after(kicked, last.t_s - impulse.t_s), 1);
    } else {
        kicked.add(model_->after(last.state, impulse.t_s - last.t_s), 1);
        pieces_.push_back({impulse.t_s, kicked});
    }
    widen(pieces_.back().state);
}

void BodyMotion::widen(const OscillatorState& state) {
    at_rest_ = at_rest_ && (state.z.array() == 0).all() && (state.z_dot.array() == 0).all();
    bounds_.widen(model_->bounds(state));
}

BodyPose BodyMotion::pose_at(double t_s) const noexcept {
    if (at_rest_) return {};
    std::size_t k = pieces_.size() - 1;
    while (k > 0 && pieces_[k].t_s > t_s) --k;
    return model_->pose(model_->after(pieces_[k].state, t_s - pieces_[k].t_s));
}

}  // namespace sim
