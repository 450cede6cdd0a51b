#pragma once
#include <render/scene.h>

#include <optional>
#include <span>
#include <vector>

#include "files/option_values.h"

namespace app {

/// A side from which a kit or scene is seen, whole and as large as it can be.
enum class CameraSide {
    drummer,  ///< from behind the player, 40 degrees down, along -z
    front,    ///< from where the audience sits, 15 degrees down, along +z
    top,      ///< straight down, -z at the top of the picture
    side,     ///< from the player's right, 15 degrees down, along -x
};

/// A place of the camera at a time of the run.
struct CameraAt {
    double t_s = 0;
    render::Camera camera;
};

/// What was asked for: a side, or places in order of time (one: it stands still), or nothing.
struct CameraChoice {
    std::optional<CameraSide> side;
    std::vector<CameraAt> places;
};

/// "drummer|front|top|side", "EX,EY,EZ:TX,TY,TZ" or "EX,EY,EZ:TX,TY,TZ:FOV" (eye, target [m], vertical field of view
/// [degrees]), or a file FILE.toml with tables [[camera]] of `time`, `eye`, `target` and `vertical_fov_deg`.
[[nodiscard]] ValueFormat<CameraChoice> camera_format();

/// The nearest camera with a vertical field of view of 45 degrees that looks along the side's direction and has
/// all points [m] at least 4 % of the picture's width and height from its edges. In the camera's axes, with the
/// depth z along its direction and the tangents t of half the field, |x - x_eye| <= t (z - z_eye) for every
/// point is t z_eye <= (min(x + t z) - max(x - t z)) / 2; the eye is where equality holds for the width or the
/// height. The target lies in the middle of the points' depths. `aspect`: width / height; `points` not empty.
[[nodiscard]] render::Camera fitted_camera(CameraSide side, std::span<const Eigen::Vector3f> points,
                                           float aspect);

/// The camera of a picture whose time does not matter: the side asked for, or the single place, else `own`, else
/// the drummer's side.
[[nodiscard]] render::Camera standing_camera(const CameraChoice& choice,
                                             const std::optional<render::Camera>& own,
                                             std::span<const Eigen::Vector3f> points, float aspect);
/// Where it is at t_s, straight on between two places and at rest before the first and after the last; none where
/// it stands still. World +y is up in the picture, but on a way whose view v comes within 15 degrees of the vertical,
/// where that would turn the picture at once: there the up of the place before is carried along as v turns, by the
/// smallest turn R from v_a to v, and the roll r by which it misses the up of the next place is spread over the way:
/// up = rotation(v, share r) R up_a. Both ends are then as the ways beside them have them, and a place that looks
/// straight up or down has the up that came there.
[[nodiscard]] std::optional<render::Camera> moving_camera(const CameraChoice& choice, double t_s);

}  // namespace app
