#pragma once
#include <Eigen/Core>
#include <memory>

#include "tracking/path_model.h"
#include "tracking/trace.h"

namespace tracking {

/// Whether a stick moves as those that a model was learned from.
///
/// The model's path (PathModel), which stays as it is, predicts the tracked point 1/15 s ahead; so does the velocity
/// between the newest sample and the one before it that is 1/150 s older or more. With the errors e that turned out while the stick moved, the newest weighing most
/// (exp(-age / 10 s)), the motion is known once they cover 0.4 s and
///   sum |e_model|^2 < r^2 sum |e_velocity|^2,  r = 0.65.
///
/// One stick; a pure function of its samples. Allocates when it is made; a sample costs about 1 us.
class KnownMotion {
public:
    /// `shaft`: unit, hand to tip, in the tracked body's frame.
    KnownMotion(const PathModel& model, const Eigen::Vector3d& shaft);
    KnownMotion(KnownMotion&& other) noexcept;
    KnownMotion& operator=(KnownMotion&& other) noexcept;
    ~KnownMotion();

    /// Samples that are not newer are passed over. A gap (kGapS) takes nothing from what has turned out.
    void push(const PoseSample& sample) noexcept;
    [[nodiscard]] bool is_known() const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tracking
