#pragma once
#include <tracking/motion.h>

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace app {

/// What pictures show beside the kit and the sticks (`play --show`).
struct Shown {
    bool ghosts = false, marks = false;
};

/// A stick where its sensor was in the newest sample that the picture may use, where it is predicted to be when the
/// picture is shown, and where it truly is then; without a pose it is not drawn.
struct StickGhosts {
    std::optional<tracking::PosePrediction> measured, predicted, truth;
};

/// How a note ended: sounded in time, sounded late, or cancelled.
enum class MarkKind { released, late, cancelled };
/// A disc on the surface where it was struck, [m], world; `normal` of unit length.
struct StrikeMark {
    MarkKind kind = MarkKind::released;
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitY();
};

/// Of one picture.
struct Annotations {
    std::vector<StickGhosts> ghosts;  ///< by stick
    std::vector<StrikeMark> marks;    ///< of a kind more than 12 are not drawn
};

}  // namespace app
