#pragma once
#include <vector>

#include "struck/body_model.h"

namespace sim {

/// A body's motion from one time on, under impulses known beforehand: free motion from each impulse to the
/// next, exact at any time. Reused from step to step; allocates only when there are more impulses than ever
/// before.
class BodyMotion {
public:
    explicit BodyMotion(const BodyModel& model) : model_(&model) { pieces_.reserve(32); }

    /// Free motion from `now` at `t_s`; earlier times see `now`.
    void start(double t_s, const OscillatorState& now);
    /// Adds an impulse. Impulses come in order of time; one from before the start acts from the start on with
    /// its response by then.
    void add(const Impulse& impulse);

    [[nodiscard]] BodyPose pose_at(double t_s) const noexcept;  ///< at any time from the start on
    /// Bounds over the whole motion.
    [[nodiscard]] const MotionBounds& bounds() const noexcept { return bounds_; }

private:
    struct Piece {
        double t_s;
        OscillatorState state;
    };
    void widen(const OscillatorState& state);

    const BodyModel* model_;
    std::vector<Piece> pieces_;
    MotionBounds bounds_;
    bool at_rest_ = true;
};

}  // namespace sim
