#include "pictures/kit_stage.h"

#include <fmt/format.h>
#include <sim/simulation.h>
#include <tracking/rotation.h>

#include "files/assets.h"
#include "pictures/stage_parts.h"

namespace app {
namespace {

constexpr int kKitShadowTexels = 512;       // per side: 1024 costs a tenth of a frame more and shows no more
constexpr double kMeshStickLengthM = 0.40;  // of stick.obj and mallet.obj, hand to tip

render::Look chrome() {
    render::Look look;
    look.body = {Eigen::Vector3f(0.72f, 0.73f, 0.75f), 1.0f, 0.20f};
    look.parts = {{"rubber", {Eigen::Vector3f(0.02f, 0.02f, 0.02f), 0.0f, 0.7f}}};
    return look;
}

}  // namespace

KitStage::KitStage(const Kit& kit, std::size_t sticks, const StickGeometry& stick)
    : kit_(kit), sticks_(sticks), stick_(stick) {
    for (const Instrument& instrument : kit_.instruments)
        if (instrument.drawn_stand && instrument.kind != "string") add_stand(instrument);
    add_string_frame();
}

void KitStage::add_stand(const Instrument& instrument) {
    const sim::BodyDefinition& body = instrument.body;
    const bool below = instrument.kind == "drum";
    const Eigen::Vector3d hold(0, below ? -body.shape.semi_axes.y() : 0, 0);
    const Eigen::Vector3d top = body.world_from_body * hold;
    const double height = top.y() - kit_.room.floor_height;
    if (height < 0.05) return;
    const double spread = below ? std::max(1.0, 2.2 * body.shape.semi_axes.x() / 0.5) : 1.0;
    add_prop(instrument.name + " stand", "stand.obj", chrome(), {spread, height, spread}, top);
}

void KitStage::add_string_frame() {
    Eigen::AlignedBox3d box;
    for (const Instrument& instrument : kit_.instruments)
        if (instrument.kind == "string" && instrument.drawn_stand)
            for (const double side : {-1.0, 1.0})
                box.extend(instrument.body.world_from_body *
                           Eigen::Vector3d(side * instrument.body.shape.semi_axes.x(), 0, 0));
    if (box.isEmpty()) return;
    const double thickness = 0.03, gap = 0.05;
    const Eigen::Vector3d size(box.sizes().x() + 0.12, thickness, box.sizes().z() + 0.12);
    const Eigen::Vector3d place(box.center().x(), box.min().y() - gap, box.center().z());
    add_prop("soundboard", "string_frame.obj", wood(0.26f, 0.13f, 0.06f, 0.4f), 0.5 * size, place);
    const double height = std::max(0.05, place.y() - kit_.room.floor_height);
    add_prop("soundboard stand", "stand.obj", chrome(), {1.5, height, 1.5}, place);
}

void KitStage::add_prop(const std::string& name, const char* mesh, const render::Look& look,
                        const Eigen::Vector3d& size, const Eigen::Vector3d& place) {
    props_.push_back(
        {{name, assets_folder() / "meshes" / mesh, look}, affine_matrix(size.asDiagonal(), place)});
}

render::SceneDescription KitStage::scene(int width, int height) const {
    render::SceneDescription scene;
    for (const Instrument& instrument : kit_.instruments)
        scene.objects.push_back({instrument.name, instrument.mesh, instrument.look});
    for (const Prop& prop : props_) scene.objects.push_back(prop.object);
    for (std::size_t i = 0; i < sticks_; ++i)
        scene.objects.push_back(
            {fmt::format("stick {}", i), kit_.stick.mesh, wood(0.62f, 0.40f, 0.20f, 0.38f)});
    scene.camera = kit_.camera;
    scene.room = kit_.room;
    scene.width = width;
    scene.height = height;
    scene.shadow_size = kKitShadowTexels;
    return scene;
}

Eigen::Matrix4f KitStage::stick_matrix(const tracking::PosePrediction& pose) const {
    // The mesh runs along -z and has its bead's centre at (0, 0, -0.40).
    const Eigen::Quaterniond body_from_mesh =
        tracking::rotation_between(-Eigen::Vector3d::UnitZ(), stick_.shaft);
    const double scale = stick_.length_m / kMeshStickLengthM;
    const Eigen::Matrix3d world_from_body = pose.orientation.toRotationMatrix();
    const Eigen::Vector3d hand = stick_.tip + stick_.shaft * -stick_.length_m;
    return affine_matrix(world_from_body * (body_from_mesh.toRotationMatrix() * scale),
                         world_from_body * hand + pose.position);
}

render::FrameState KitStage::frame(std::span<const sim::ModalState> bodies,
                                   std::span<const std::optional<tracking::PosePrediction>> sticks) const {
    render::FrameState state;
    const auto add = [&](const Eigen::Matrix4f& matrix, bool visible) {
        state.world_from_object.push_back(matrix);
        state.visible.push_back(visible);
    };
    for (std::size_t i = 0; i < kit_.instruments.size(); ++i) {
        const sim::BodyDefinition& body = kit_.instruments[i].body;
        Eigen::Matrix4d matrix = sim::body_matrix(body, bodies.empty() ? sim::ModalState{} : bodies[i]);
        const std::optional<double>& scale = kit_.instruments[i].mesh_scale_m;
        const Eigen::Vector3d sides = scale ? Eigen::Vector3d::Constant(*scale) : body.shape.semi_axes;
        matrix.leftCols<3>() *= sides.asDiagonal();
        add(matrix.cast<float>(), true);
    }
    for (const Prop& prop : props_) add(prop.matrix, true);
    for (std::size_t i = 0; i < sticks_; ++i) {
        const bool visible = i < sticks.size() && sticks[i].has_value();
        add(visible ? stick_matrix(*sticks[i]) : Eigen::Matrix4f(Eigen::Matrix4f::Identity()), visible);
    }
    return state;
}

}  // namespace app
