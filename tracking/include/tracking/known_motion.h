#pragma once
#include <Eigen/Core>
#include <memory>

#include "tracking/path_model.h"
#include "tracking/trace.h"

namespace tracking {

/// Whether a stick moves as those that a model was learned from.
///
/// Two predictions of the tracked point, 1/15 s ahead, are compared: the model's path (PathModel, without
/// learning), and the velocity between the newest sample and one at least 1/150 s older. The errors e of both
/// are summed while the stick moves, with weights exp(-age / 10 s). The motion is known once the errors cover
/// 0.4 s and
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

    /// Ignores samples that are not newer. A gap (kGapS) leaves the sums as they are.
    void push(const PoseSample& sample) noexcept;
    [[nodiscard]] bool is_known() const noexcept;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tracking
