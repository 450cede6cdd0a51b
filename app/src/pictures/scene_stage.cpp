#include "pictures/scene_stage.h"

#include <sim/surface_mesh.h>

#include <span>

#include "pictures/stage_parts.h"

namespace app {
namespace {

constexpr int kSceneShadowTexels = 1024;
constexpr double kKerb = 0.03;  // half height and half thickness, as share of the box's longer side

/// The vertices that are drawn: all but the features.
std::span<const Eigen::Vector3d> drawn_of(const sim::SurfaceMesh& surface) {
    return std::span(surface.vertices).first(surface.vertices.size() - surface.features);
}

render::Mesh mesh_of(const sim::SurfaceMesh& surface) {
    render::MeshPart part;
    for (std::size_t k = 0; k < drawn_of(surface).size(); ++k) {
        part.positions.push_back(surface.vertices[k].cast<float>());
        part.normals.push_back(surface.normals[k].cast<float>());
    }
    for (const auto& triangle : surface.triangles)
        part.indices.insert(part.indices.end(), triangle.begin(), triangle.end());
    return {{part}};
}

/// I + du/dr of a body whose strain is uniform.
Eigen::Matrix3d uniform_strain(const sim::ModalBasis& basis, const Eigen::VectorXd& q) {
    const Eigen::VectorXd nodal = basis.nodal * q;
    return Eigen::Matrix3d::Identity() + sim::displacement_at(basis, nodal, Eigen::Vector3d::Zero()).gradient;
}

}  // namespace

SceneStage::SceneStage(const Scene& scene, const sim::World& world, CameraChoice camera)
    : scene_(scene), camera_(std::move(camera)) {
    const std::size_t now = scene.world.bodies.size();
    sim::WorldDefinition later;
    later.bodies = scene.later;
    const sim::World coming(later);
    for (std::size_t body = 0; body < scene.looks.size(); ++body) {
        const std::size_t kind = scene.looks[body].kind;
        if (kind < solid_of_kind_.size()) continue;
        solid_of_kind_.push_back(static_cast<int>(solids_.size()));
        const bool here = body < now;
        add_solid(here ? world : coming, static_cast<int>(here ? body : body - now));
    }
    if (scene.box) add_kerbs();
    for (CameraAt& place : camera_.places) place.camera = scaled(place.camera);
    add_corners(frame(world));
}

void SceneStage::add_corners(const render::FrameState& first) {
    for (std::size_t k = 0; k < first.visible.size(); ++k) {
        if (!first.visible[k]) continue;
        const int solid = k < scene_.looks.size() ? solid_of_kind_[scene_.looks[k].kind] : kerb_solid_;
        const Eigen::AlignedBox3f box = solids_[static_cast<std::size_t>(solid)].mesh.bounds();
        for (int i = 0; i < 8; ++i) {
            const auto corner = static_cast<Eigen::AlignedBox3f::CornerType>(i);
            corners_.push_back((first.world_from_object[k] * box.corner(corner).homogeneous()).head<3>());
        }
    }
}

void SceneStage::add_solid(const sim::World& world, int body) {
    const sim::WorldBody& definition = world.definition(body);
    const sim::SurfaceMesh surface = sim::surface_mesh(definition.shape, definition.triangles);
    const sim::ModalBasis& basis = world.basis(body);
    const bool bends = world.fidelity(body).fidelity == sim::Fidelity::modal;
    solids_.push_back({mesh_of(surface), shapes_at(drawn_of(surface), basis, bends ? basis.count() : 0)});
}

void SceneStage::add_kerbs() {
    kerb_solid_ = static_cast<int>(solids_.size());
    const sim::SurfaceMesh bar = sim::surface_mesh({{Eigen::Vector3d::Ones(), 0.1, 0.1}, {}}, 1000);
    solids_.push_back({mesh_of(bar), {}});
    const SceneBox& box = *scene_.box;
    const double thick = kKerb * box.size.maxCoeff();
    for (const int side : {0, 1}) {
        for (const double sign : {-1.0, 1.0}) {
            Eigen::Vector3d half(0.5 * box.size[0] + 2 * thick, thick, 0.5 * box.size[1] + 2 * thick);
            Eigen::Vector3d at(box.center[0], box.floor, box.center[1]);
            at[2 * side] += sign * (0.5 * box.size[side] + thick);
            half[2 * side] = thick;
            kerbs_.push_back(matrix(Eigen::Isometry3d(Eigen::Translation3d(at)), half.asDiagonal()));
        }
    }
}

render::SceneDescription SceneStage::description(int width, int height) const {
    render::SceneDescription description;
    const auto scale = static_cast<float>(scene_.drawn_scale);
    for (const BodyLook& look : scene_.looks)
        description.objects.push_back({"body", {}, {look.appearance, {}}, solid_of_kind_[look.kind]});
    for (std::size_t k = 0; k < kerbs_.size(); ++k)
        description.objects.push_back({"kerb", {}, wood(0.10f, 0.045f, 0.02f, 0.5f), kerb_solid_});
    description.solids = solids_;
    const std::optional<render::Camera> own =
        scene_.camera ? std::optional(scaled(*scene_.camera)) : std::nullopt;
    description.camera =
        standing_camera(camera_, own, corners_, static_cast<float>(width) / static_cast<float>(height));
    description.room = scene_.room;
    description.room.floor_height *= scale;
    description.width = width, description.height = height;
    description.shadow_size = kSceneShadowTexels;
    return description;
}

/// As everything that is drawn.
render::Camera SceneStage::scaled(render::Camera camera) const {
    const auto scale = static_cast<float>(scene_.drawn_scale);
    camera.eye *= scale, camera.target *= scale;
    return camera;
}

Eigen::Matrix4f SceneStage::matrix(const Eigen::Isometry3d& pose, const Eigen::Matrix3d& strain) const {
    return affine_matrix(scene_.drawn_scale * pose.linear() * strain,
                         scene_.drawn_scale * pose.translation());
}

render::FrameState SceneStage::frame(const sim::World& world) const {
    render::FrameState frame;
    frame.camera = moving_camera(camera_, world.time_s());
    const auto now = static_cast<std::size_t>(world.bodies());
    for (std::size_t k = 0; k < scene_.looks.size(); ++k) {
        frame.visible.push_back(k < now);
        frame.world_from_object.push_back(Eigen::Matrix4f::Identity());
        const int modes = solids_[static_cast<std::size_t>(solid_of_kind_[scene_.looks[k].kind])].modes.count;
        frame.modal.push_back(Eigen::VectorXf::Zero(modes));
        if (k >= now) continue;
        const auto body = static_cast<int>(k);
        const sim::WorldBodyState state = world.state(body);
        Eigen::Isometry3d pose = Eigen::Translation3d(state.position) * state.orientation;
        Eigen::Matrix3d strain = Eigen::Matrix3d::Identity();
        if (modes > 0)
            frame.modal.back() = state.q.cast<float>();
        else if (state.q.size() > 0)
            strain = uniform_strain(world.basis(body), state.q);
        frame.world_from_object.back() = matrix(pose, strain);
    }
    for (const Eigen::Matrix4f& kerb : kerbs_) {
        frame.world_from_object.push_back(kerb);
        frame.visible.push_back(true);
        frame.modal.emplace_back();
    }
    return frame;
}

}  // namespace app
