#pragma once
#include <render/scene.h>
#include <sim/modal_body.h>
#include <tracking/predictor.h>

#include <optional>
#include <span>
#include <vector>

#include "kit/kit.h"
#include "pictures/annotations.h"
#include "pictures/camera.h"

namespace app {

/// What is on stage: the kit's instruments, their stands, and the sticks; how a state of the bodies and
/// sticks becomes matrices.
class KitStage {
public:
    /// Seen as asked for, else by the kit's camera, else whole from the drummer's side.
    KitStage(const Kit& kit, std::size_t sticks, const StickGeometry& stick, CameraChoice camera = {},
             Shown shown = {});

    /// Where tip and shaft are in the tracked body, once that is known of live sticks.
    void set_stick(const StickGeometry& stick) { stick_ = stick; }
    [[nodiscard]] render::SceneDescription scene(int width, int height) const;
    /// Bodies in the kit's order (empty: all at rest); a stick without a pose is not drawn. `t_s`: since the first
    /// frame, for a camera that moves.
    [[nodiscard]] render::FrameState frame(std::span<const sim::ModalState> bodies,
                                           std::span<const std::optional<tracking::PosePrediction>> sticks,
                                           double t_s = 0, const Annotations& annotations = {}) const;

private:
    struct Prop {  // does not move
        render::SceneObject object;
        Eigen::Matrix4f matrix;
    };
    void add_stand(const Instrument& instrument);
    void add_gallows(const Instrument& instrument);
    void add_string_frame();
    /// `mesh`: a file of the bundled meshes; `size`: factors of its sides.
    void add_prop(const std::string& name, const char* mesh, const render::Look& look,
                  const Eigen::Vector3d& size, const Eigen::Vector3d& place);
    void describe_annotations(render::SceneDescription& scene) const;
    void add_annotations(render::FrameState& state, const Annotations& annotations) const;
    /// `across`: a factor of its thickness.
    [[nodiscard]] Eigen::Matrix4f stick_matrix(const tracking::PosePrediction& pose, double across = 1) const;

    Kit kit_;
    std::size_t sticks_;
    StickGeometry stick_;
    CameraChoice camera_;
    Shown shown_;
    std::vector<Eigen::AlignedBox3f> bounds_;  ///< of the instruments' meshes, in their own units
    std::vector<Prop> props_;
};

}  // namespace app
