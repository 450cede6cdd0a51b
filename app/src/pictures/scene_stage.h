#pragma once
#include <render/scene.h>
#include <sim/world.h>

#include <vector>

#include "scene/scene.h"

namespace app {

/// How the bodies of a scene and its box are drawn: one mesh (and its modes) for each kind, and how states
/// become matrices and modal coordinates. Bodies that come later are not drawn before.
class SceneStage {
public:
    SceneStage(const Scene& scene, const sim::World& world);

    [[nodiscard]] render::SceneDescription description(int width, int height) const;
    [[nodiscard]] render::FrameState frame(const sim::World& world) const;

private:
    void add_solid(const sim::World& world, int body);
    void add_kerbs();
    [[nodiscard]] Eigen::Matrix4f matrix(const Eigen::Isometry3d& pose, const Eigen::Matrix3d& strain) const;

    const Scene& scene_;
    std::vector<render::Solid> solids_;
    std::vector<int> solid_of_kind_;
    std::vector<Eigen::Matrix4f> kerbs_;  ///< that show where the walls of the box are
    int kerb_solid_ = -1;
};

}  // namespace app
