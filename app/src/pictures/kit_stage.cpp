#include "pictures/kit_stage.h"

#include <fmt/format.h>
#include <render/mesh.h>
#include <sim/simulation.h>
#include <tracking/rotation.h>

#include <array>

#include "files/assets.h"
#include "pictures/stage_parts.h"

namespace app {
namespace {

constexpr int kMostShadowTexels = 4096;     // per side
constexpr double kMeshStickLengthM = 0.40;  // of stick.obj and mallet.obj, hand to tip
/// A body whose surface is nowhere farther from rest is drawn at rest: a tenth of a pixel of a picture of 4K
/// across a kit, so that what has rung out stands still. [m]
constexpr double kRestM = 5e-5;

// Linear RGB: of where a stick was measured, is predicted and truly is; of notes released, late and cancelled.
const std::array<Eigen::Vector3f, 3> kGhostColors = {Eigen::Vector3f(0.02f, 0.12f, 0.80f),
                                                     Eigen::Vector3f(0.80f, 0.45f, 0.02f),
                                                     Eigen::Vector3f(0.02f, 0.55f, 0.05f)};
const std::array<Eigen::Vector3f, 3> kMarkColors = {Eigen::Vector3f(0.02f, 0.55f, 0.05f),
                                                    Eigen::Vector3f(0.80f, 0.30f, 0.01f),
                                                    Eigen::Vector3f(0.70f, 0.01f, 0.02f)};
constexpr std::size_t kMostMarks = 12;  // of a kind
/// Of a stick's thickness, in that order: none is hidden in the stick, nor the truth in a right prediction.
constexpr std::array<double, 3> kGhostAcross = {1.1, 1.2, 1.3};
constexpr double kMarkRadiusM = 0.03, kMarkHalfHeightM = 0.002;

render::Look plain(const Eigen::Vector3f& color) {
    return {{color, 0.0f, 0.8f}, {}};
}

Eigen::Matrix4f disc_at(const StrikeMark& mark) {
    const Eigen::Matrix3d turned =
        tracking::rotation_between(Eigen::Vector3d::UnitY(), mark.normal).toRotationMatrix();
    return affine_matrix(turned * Eigen::Vector3d(kMarkRadiusM, kMarkHalfHeightM, kMarkRadiusM).asDiagonal(),
                         mark.point + kMarkHalfHeightM * mark.normal);
}

render::Look chrome() {
    render::Look look;
    look.body = {Eigen::Vector3f(0.72f, 0.73f, 0.75f), 1.0f, 0.20f};
    look.parts = {{"rubber", {Eigen::Vector3f(0.02f, 0.02f, 0.02f), 0.0f, 0.7f}}};
    return look;
}

/// Of an instrument's mesh, which may have a size of its own.
Eigen::Matrix4f mesh_matrix(const Instrument& instrument, const sim::ModalState& state) {
    return (sim::body_matrix(instrument.body, state) * instrument.body_from_mesh.matrix()).cast<float>();
}

/// Of boxes around the instruments at rest.
std::vector<Eigen::Vector3f> corners_of(const Kit& kit, const std::vector<Eigen::AlignedBox3f>& bounds) {
    std::vector<Eigen::Vector3f> corners;
    for (std::size_t i = 0; i < kit.instruments.size(); ++i) {
        const Eigen::Matrix4f rest = mesh_matrix(kit.instruments[i], {});
        for (int k = 0; k < 8; ++k) {
            const auto corner = static_cast<Eigen::AlignedBox3f::CornerType>(k);
            corners.push_back((rest * bounds[i].corner(corner).homogeneous()).head<3>());
        }
    }
    return corners;
}

/// A bound of how far a point of the box lies from where the other matrix puts it.
double farthest(const Eigen::Matrix4f& a, const Eigen::Matrix4f& b, const Eigen::AlignedBox3f& box) {
    const Eigen::Matrix4f difference = a - b;
    double most = 0;
    for (int k = 0; k < 8; ++k) {
        const Eigen::Vector3f corner = box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(k));
        most = std::max(most, double((difference * corner.homogeneous()).norm()));
    }
    return most;
}

}  // namespace

KitStage::KitStage(const Kit& kit, std::size_t sticks, const StickGeometry& stick, CameraChoice camera,
                   Shown shown)
    : kit_(kit), sticks_(sticks), stick_(stick), camera_(std::move(camera)), shown_(shown) {
    for (const Instrument& instrument : kit_.instruments) {
        // Bundled meshes and those without a scale fill the body's box.
        bounds_.push_back(instrument.mesh_scale_m
                              ? render::load_mesh(instrument.mesh).bounds()
                              : Eigen::AlignedBox3f(Eigen::Vector3f(-1, -1, -1), Eigen::Vector3f(1, 1, 1)));
        if (instrument.drawn_stand && instrument.kind != "string") add_stand(instrument);
    }
    add_string_frame();
}

void KitStage::add_stand(const Instrument& instrument) {
    const sim::BodyDefinition& body = instrument.body;
    if (instrument.kind == "bell" && body.stand.hinged) {
        add_gallows(instrument);
        return;
    }
    const bool below = instrument.kind == "drum" || !body.stand.hinged;
    const Eigen::Vector3d hold(0, below ? -body.shape.semi_axes.y() : 0, 0);
    const Eigen::Vector3d top = body.world_from_body * hold;
    const double height = top.y() - kit_.room.floor_height;
    if (height < 0.05) return;
    const double spread = below ? std::max(1.0, 2.2 * body.shape.semi_axes.x() / 0.5) : 1.0;
    add_prop(instrument.name + " stand", "stand.obj", chrome(), {spread, height, spread}, top);
}

/// A post behind the bell and an arm from its top to over the crown, from which the bell hangs.
void KitStage::add_gallows(const Instrument& instrument) {
    const sim::BodyDefinition& body = instrument.body;
    const Eigen::Vector3d half = body.shape.semi_axes;
    const Eigen::Vector3d crown = body.world_from_body * Eigen::Vector3d(0, half.y(), 0);
    const double thick = 0.006, length = std::max(half.x(), half.z()) + 0.05;
    const Eigen::Vector3d top = crown + Eigen::Vector3d(0, 0.5 * thick, -length);  // through the crown's eye
    if (top.y() - kit_.room.floor_height < 0.05) return;
    add_prop(instrument.name + " stand", "stand.obj", chrome(), {1, top.y() - kit_.room.floor_height, 1},
             top);
    add_prop(instrument.name + " arm", "bar.obj", chrome(), {thick, thick, 0.5 * length + thick},
             top + Eigen::Vector3d(0, 0, 0.5 * length));
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
    for (const Instrument& instrument : kit_.instruments) {
        if (instrument.kind != "string" || !instrument.drawn_stand) continue;
        for (const double side : {-1.0, 1.0}) {  // a bridge of its own at each end
            const Eigen::Vector3d end = instrument.body.world_from_body *
                                        Eigen::Vector3d(side * instrument.body.shape.semi_axes.x(), 0, 0);
            const double half = 0.5 * (end.y() - place.y());
            add_prop(instrument.name + " bridge", "bar.obj", wood(0.10f, 0.045f, 0.02f, 0.4f),
                     {0.006, half, 0.012}, end - Eigen::Vector3d(0, half, 0));
        }
    }
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
        scene.objects.push_back(
            {instrument.name, instrument.mesh, instrument.look, -1, mesh_matrix(instrument, {})});
    for (const Prop& prop : props_) {
        scene.objects.push_back(prop.object);
        scene.objects.back().stands = prop.matrix;
    }
    for (std::size_t i = 0; i < sticks_; ++i)
        scene.objects.push_back({.name = fmt::format("stick {}", i),
                                 .mesh = kit_.stick.mesh,
                                 .look = wood(0.62f, 0.40f, 0.20f, 0.38f),
                                 .shadow = render::Shadow::widened});
    describe_annotations(scene);
    scene.camera = standing_camera(camera_, kit_.camera, corners_of(kit_, bounds_),
                                   static_cast<float>(width) / static_cast<float>(height));
    scene.room = kit_.room;
    scene.width = width;
    scene.height = height;
    // The map is 1.25 times as wide as the picture at the target: a texel is there smaller than a pixel.
    scene.shadow_size = std::min(kMostShadowTexels, 8 * std::max(width, height) / 5);
    return scene;
}

/// As add_annotations() places them.
void KitStage::describe_annotations(render::SceneDescription& scene) const {
    if (shown_.ghosts)
        for (std::size_t i = 0; i < sticks_; ++i)
            for (const Eigen::Vector3f& color : kGhostColors)
                scene.objects.push_back({.name = fmt::format("ghost of stick {}", i),
                                         .mesh = kit_.stick.mesh,
                                         .look = plain(color),
                                         .shadow = render::Shadow::none});
    if (shown_.marks)
        for (const Eigen::Vector3f& color : kMarkColors)
            for (std::size_t i = 0; i < kMostMarks; ++i)
                scene.objects.push_back({"mark", assets_folder() / "meshes" / "drum.obj", plain(color)});
}

void KitStage::add_annotations(render::FrameState& state, const Annotations& annotations) const {
    const auto add = [&](const std::optional<Eigen::Matrix4f>& matrix) {
        state.world_from_object.push_back(matrix.value_or(Eigen::Matrix4f::Identity()));
        state.visible.push_back(matrix.has_value());
    };
    for (std::size_t i = 0; shown_.ghosts && i < sticks_; ++i) {
        const StickGhosts ghosts = i < annotations.ghosts.size() ? annotations.ghosts[i] : StickGhosts();
        const std::array poses = {&ghosts.measured, &ghosts.predicted, &ghosts.truth};
        for (std::size_t k = 0; k < poses.size(); ++k)
            add(*poses[k] ? std::optional(stick_matrix(**poses[k], kGhostAcross[k])) : std::nullopt);
    }
    if (!shown_.marks) return;
    for (const MarkKind kind : {MarkKind::released, MarkKind::late, MarkKind::cancelled}) {
        std::size_t drawn = 0;
        for (const StrikeMark& mark : annotations.marks)
            if (mark.kind == kind && drawn < kMostMarks) add(disc_at(mark)), ++drawn;
        for (; drawn < kMostMarks; ++drawn) add(std::nullopt);
    }
}

Eigen::Matrix4f KitStage::stick_matrix(const tracking::PosePrediction& pose, double across) const {
    // The mesh runs along -z and has its bead's centre at (0, 0, -0.40).
    const Eigen::Quaterniond body_from_mesh =
        tracking::rotation_between(-Eigen::Vector3d::UnitZ(), stick_.shaft);
    const double scale = stick_.length_m / kMeshStickLengthM;
    const Eigen::Matrix3d world_from_body = pose.orientation.toRotationMatrix();
    const Eigen::Vector3d hand = stick_.tip + stick_.shaft * -stick_.length_m;
    const Eigen::Vector3d size(across * scale, across * scale, scale);
    return affine_matrix(world_from_body * body_from_mesh.toRotationMatrix() * size.asDiagonal(),
                         world_from_body * hand + pose.position);
}

render::FrameState KitStage::frame(std::span<const sim::ModalState> bodies,
                                   std::span<const std::optional<tracking::PosePrediction>> sticks,
                                   double t_s, const Annotations& annotations) const {
    render::FrameState state;
    state.camera = moving_camera(camera_, t_s);
    const auto add = [&](const Eigen::Matrix4f& matrix, bool visible) {
        state.world_from_object.push_back(matrix);
        state.visible.push_back(visible);
    };
    for (std::size_t i = 0; i < kit_.instruments.size(); ++i) {
        const Eigen::Matrix4f rest = mesh_matrix(kit_.instruments[i], {});
        const Eigen::Matrix4f now = bodies.empty() ? rest : mesh_matrix(kit_.instruments[i], bodies[i]);
        add(farthest(now, rest, bounds_[i]) < kRestM ? rest : now, true);
    }
    for (const Prop& prop : props_) add(prop.matrix, true);
    for (std::size_t i = 0; i < sticks_; ++i) {
        const bool visible = i < sticks.size() && sticks[i].has_value();
        add(visible ? stick_matrix(*sticks[i]) : Eigen::Matrix4f(Eigen::Matrix4f::Identity()), visible);
    }
    add_annotations(state, annotations);
    return state;
}

}  // namespace app
