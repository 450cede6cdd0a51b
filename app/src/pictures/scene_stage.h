#pragma once
#include <render/scene.h>
#include <sim/world.h>

#include <vector>

#include "pictures/camera.h"
#include "scene/scene.h"

namespace app {

/// How the bodies of a scene and its box are drawn: one mesh (and its modes) for each kind, and how states
/// become matrices and modal coordinates. Bodies that come later are not drawn before.
class SceneStage {
public:
    /// Seen as asked for, else by the scene's camera, else from the drummer's side with all that `world` and the
    /// box hold.
    SceneStage(const Scene& scene, const sim::World& world, CameraChoice camera = {});

    [[nodiscard]] render::SceneDescription description(int width, int height) const;
    [[nodiscard]] render::FrameState frame(const sim::World& world) const;

private:
    void add_solid(const sim::World& world, int body);
    void add_kerbs();
    void add_corners(const render::FrameState& first);
    [[nodiscard]] render::Camera scaled(render::Camera camera) const;
    [[nodiscard]] Eigen::Matrix4f matrix(const Eigen::Isometry3d& pose, const Eigen::Matrix3d& strain) const;

    const Scene& scene_;
    std::vector<render::Solid> solids_;
    std::vector<int> solid_of_kind_;
    std::vector<Eigen::Matrix4f> kerbs_;  ///< that show where the walls of the box are
    int kerb_solid_ = -1;
    CameraChoice camera_;
    std::vector<Eigen::Vector3f> corners_;  ///< of boxes around what is drawn at first
};

}  // namespace app
