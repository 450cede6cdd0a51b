#include "kit_scene.h"

#include <cmath>
#include <numbers>

namespace render_bench {
namespace {

using Eigen::Affine3f;
using Eigen::AngleAxisf;
using Eigen::Vector3f;

struct Placed {
    const char* name;
    const char* mesh;
    Vector3f position, half;  ///< [m]
    float tilt_x_deg, tilt_z_deg;
};

const std::vector<Placed>& pieces() {
    static const std::vector<Placed> all = {
        {"snare", "drum", {-0.22f, 0.66f, 0.02f}, {0.178f, 0.07f, 0.178f}, 6, 0},
        {"tom1", "drum", {-0.20f, 0.86f, -0.40f}, {0.127f, 0.10f, 0.127f}, 22, 6},
        {"tom2", "drum", {0.16f, 0.86f, -0.42f}, {0.15f, 0.11f, 0.15f}, 22, -6},
        {"floor tom", "drum", {0.50f, 0.52f, -0.02f}, {0.20f, 0.20f, 0.20f}, 3, -3},
        {"bass", "drum", {0.0f, 0.29f, -0.48f}, {0.28f, 0.20f, 0.28f}, 90, 0},
        {"crash", "cymbal", {-0.52f, 1.12f, -0.42f}, {0.20f, 0.022f, 0.20f}, 14, 8},
        {"ride", "cymbal", {0.58f, 1.04f, -0.46f}, {0.255f, 0.026f, 0.255f}, 16, -10},
        {"hihat", "cymbal", {-0.62f, 0.86f, 0.02f}, {0.178f, 0.02f, 0.178f}, 0, 0},
        {"bell", "bell", {0.20f, 1.12f, -0.52f}, {0.06f, 0.06f, 0.06f}, 0, 0},
        {"crash stand", "stand", {-0.52f, 1.115f, -0.42f}, {1, 1.115f, 1}, 0, 0},
        {"ride stand", "stand", {0.58f, 1.035f, -0.46f}, {1, 1.035f, 1}, 0, 0},
        {"hihat stand", "stand", {-0.62f, 0.87f, 0.02f}, {1, 0.87f, 1}, 0, 0},
        {"snare stand", "stand", {-0.22f, 0.60f, 0.02f}, {1, 0.60f, 1}, 0, 0},
    };
    return all;
}

render::Look drum_look() {
    render::Look look;
    look.body = {{0.30f, 0.012f, 0.016f}, 0, 0.16f};
    look.parts = {{"shell", {{0.30f, 0.012f, 0.016f}, 0, 0.16f}},
                  {"head", {{0.82f, 0.80f, 0.75f}, 0, 0.55f}},
                  {"hoop", {{0.80f, 0.81f, 0.83f}, 1, 0.14f}},
                  {"lug", {{0.80f, 0.81f, 0.83f}, 1, 0.18f}}};
    return look;
}

render::Look look_of(const std::string& mesh) {
    render::Look look;
    if (mesh == "drum") return drum_look();
    if (mesh == "cymbal") look.body = {{0.78f, 0.50f, 0.18f}, 1, 0.32f, 0.8f};
    if (mesh == "bell") look.body = {{0.90f, 0.68f, 0.32f}, 1, 0.14f};
    if (mesh == "stand")
        look = {{{0.72f, 0.73f, 0.75f}, 1, 0.20f}, {{"rubber", {{0.02f, 0.02f, 0.02f}, 0, 0.7f}}}};
    if (mesh == "stick") look.body = {{0.62f, 0.40f, 0.20f}, 0, 0.38f};
    return look;
}

}  // namespace

render::SceneDescription kit_scene(const std::string& meshes) {
    render::SceneDescription scene;
    for (const Placed& piece : pieces()) {
        scene.objects.push_back({piece.name, meshes + "/" + piece.mesh + ".obj", look_of(piece.mesh)});
    }
    for (const char* hand : {"left", "right"})
        scene.objects.push_back({.name = hand,
                                 .mesh = meshes + "/stick.obj",
                                 .look = look_of("stick"),
                                 .shadow = render::Shadow::widened});
    return scene;
}

render::FrameState kit_frame(double time_s) {
    constexpr float kDegree = std::numbers::pi_v<float> / 180;
    render::FrameState frame;
    const float swing = std::sin(static_cast<float>(time_s * 4 * std::numbers::pi));
    for (const Placed& piece : pieces()) {
        Affine3f matrix(Eigen::Translation3f(piece.position));
        matrix.rotate(AngleAxisf(piece.tilt_z_deg * kDegree, Vector3f::UnitZ()));
        matrix.rotate(AngleAxisf(piece.tilt_x_deg * kDegree, Vector3f::UnitX()));
        matrix.scale(piece.half);
        if (std::string(piece.mesh) == "drum") matrix.linear() *= 1 + 0.01f * swing;
        frame.world_from_object.push_back(matrix.matrix());
    }
    for (const float side : {-1.0f, 1.0f}) {
        Affine3f matrix(Eigen::Translation3f(-0.12f + 0.17f * side, 0.90f, 0.36f));
        matrix.rotate(AngleAxisf(0.30f * side, Vector3f::UnitY()));
        matrix.rotate(AngleAxisf(-0.22f + 0.2f * side * swing, Vector3f::UnitX()));
        frame.world_from_object.push_back(matrix.matrix());
    }
    frame.visible.assign(frame.world_from_object.size(), true);
    return frame;
}

}  // namespace render_bench
