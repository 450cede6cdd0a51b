#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "render/renderer.h"
#include "solids.h"
#include "temporary_folder.h"

namespace {

using Eigen::Affine3f;
using Eigen::Matrix4f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kWidth = 320, kHeight = 240;
constexpr float kFov = 40;  // degrees
/// Pixels from the picture's centre per unit of x / depth.
const float kFocal = 0.5f * kHeight / std::tan(kFov / 2 * std::numbers::pi_v<float> / 180);

std::string box_obj() {
    meshgen::ObjMesh mesh{"box", {}};
    meshgen::rounded_box(mesh.part("box"), {0, 0, 0}, {1, 1, 1}, {1e-4, 1e-4, 1e-4}, 1);
    return mesh.text();
}

std::string sphere_obj() {
    meshgen::ObjMesh mesh{"ball", {}};
    meshgen::sphere(mesh.part("ball"), {0, 0, 0}, 1, 96);
    return mesh.text();
}

/// White objects in a black room without a key light, seen from (0, 1, 3) along -z: a pixel is lit exactly
/// where an object is.
render::SceneDescription silhouette_scene(const std::vector<std::filesystem::path>& meshes) {
    render::SceneDescription scene;
    for (const auto& mesh : meshes) scene.objects.push_back({mesh.stem(), mesh, {{{1, 1, 1}, 0, 1}, {}}});
    scene.camera = {{0, 1, 3}, {0, 1, 0}, kFov};
    scene.room.floor_color = scene.room.wall_color = Vector3f::Zero();
    scene.room.floor_height = -1;
    scene.key_light.strength = 0;
    scene.width = kWidth;
    scene.height = kHeight;
    scene.samples = 1;
    return scene;
}

render::Image picture(render::Renderer& renderer, const std::vector<Matrix4f>& matrices,
                      std::vector<bool> visible = {}) {
    if (visible.empty()) visible.assign(matrices.size(), true);
    render::Image image;
    renderer.draw({matrices, visible}, image);
    return image;
}

int brightness(const render::Image& image, int x, int y) {
    const std::uint8_t* pixel = image.rgb.data() + 3 * (y * image.width + x);
    return pixel[0] + pixel[1] + pixel[2];
}

int lit_pixels(const render::Image& image) {
    int count = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) count += brightness(image, x, y) > 0;
    }
    return count;
}

/// Where a world point lies in the picture of the camera above: pixels, y down.
Vector2f project(const Vector3f& world) {
    const float depth = 3 - world.z();
    return {0.5f * kWidth + kFocal * world.x() / depth, 0.5f * kHeight - kFocal * (world.y() - 1) / depth};
}

/// Signed distance [pixels] from a point to the convex hull of others, positive outside: the greatest over
/// all supporting directions.
float distance_to_hull(const Vector2f& point, const std::vector<Vector2f>& corners) {
    float greatest = -std::numeric_limits<float>::infinity();
    for (int i = 0; i < 720; ++i) {
        const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / 360;
        const Vector2f direction(std::cos(angle), std::sin(angle));
        float support = -std::numeric_limits<float>::infinity();
        for (const Vector2f& corner : corners) support = std::max(support, direction.dot(corner));
        greatest = std::max(greatest, direction.dot(point) - support);
    }
    return greatest;
}

/// A convex body's picture is the hull of its corners' pictures: each pixel clearly inside is lit, each
/// clearly outside dark.
void expect_box_silhouette(render::Renderer& renderer, const Affine3f& world_from_box) {
    const render::Image image = picture(renderer, {world_from_box.matrix()});
    std::vector<Vector2f> corners;
    for (int i = 0; i < 8; ++i) {
        corners.push_back(
            project(world_from_box * Vector3f(i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f)));
    }
    int inside = 0;
    for (int y = 0; y < kHeight; y += 2) {
        for (int x = 0; x < kWidth; x += 2) {
            const float distance =
                distance_to_hull({static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}, corners);
            if (std::abs(distance) < 0.6f)
                continue;  // the outline: a pixel's half diagonal lets rounding decide
            inside += distance < 0;
            ASSERT_EQ(brightness(image, x, y) > 0, distance < 0) << x << " " << y << " distance " << distance;
        }
    }
    EXPECT_GT(inside, 200);
}

TEST(Picture, ABallOfRadius40CentimetresAt3MetresCoversTheDiscOfItsTangentCone) {
    const TemporaryFolder folder;
    render::Renderer renderer(silhouette_scene({folder.write("ball.obj", sphere_obj())}));
    const Affine3f place = Eigen::Translation3f(0, 1, 0) * Eigen::Scaling(0.4f);
    const double radius = kFocal * 0.4 / std::sqrt(3.0 * 3.0 - 0.4 * 0.4);
    const double area = std::numbers::pi * radius * radius;
    // 1 %: the mesh is inscribed (a 96-gon lacks 0.1 %) and pixels on the outline count whole (about its
    // length to the power 2/3).
    EXPECT_NEAR(lit_pixels(picture(renderer, {place.matrix()})), area, 0.01 * area);
}

TEST(Picture, ABoxMovedTurnedScaledOrShearedCoversTheHullOfItsProjectedCorners) {
    const TemporaryFolder folder;
    render::Renderer renderer(silhouette_scene({folder.write("box.obj", box_obj())}));
    Affine3f box(Eigen::Translation3f(0.3f, 1.2f, -0.5f));
    box.scale(Vector3f(0.5f, 0.2f, 0.3f));
    expect_box_silhouette(renderer, box);
    box.rotate(Eigen::AngleAxisf(0.7f, Vector3f(1, 2, 3).normalized()));
    expect_box_silhouette(renderer, box);
    Eigen::Matrix3f shear = Eigen::Matrix3f::Identity();
    shear(0, 1) = 0.8f;  // x += 0.8 y
    shear(1, 2) = -0.4f;
    box.linear() = 0.3f * shear;
    expect_box_silhouette(renderer, box);
}

TEST(Picture, TheMirroredBodyIsTheMirroredPicture) {
    const TemporaryFolder folder;
    render::SceneDescription scene = silhouette_scene({folder.write("box.obj", box_obj())});
    scene.key_light = {{0, 0.3f, 1}, {1, 1, 1}, 1};  // from the front, the same for both
    render::Renderer renderer(scene);
    Affine3f box(Eigen::Translation3f(0.2f, 1.1f, 0));
    box.rotate(Eigen::AngleAxisf(0.5f, Vector3f(2, 1, 1).normalized())).scale(Vector3f(0.5f, 0.3f, 0.2f));
    const Matrix4f mirror = Eigen::Vector4f(-1, 1, 1, 1).asDiagonal();
    const render::Image plain = picture(renderer, {box.matrix()}),
                        mirrored = picture(renderer, {mirror * box.matrix()});
    double difference = 0;
    int lit = 0, lit_once = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const int a = brightness(plain, x, y), b = brightness(mirrored, kWidth - 1 - x, y);
            lit += a > 0;
            lit_once += (a > 0) != (b > 0);
            difference += std::abs(a - b) / 3.0;
        }
    }
    ASSERT_GT(lit, 2000);
    EXPECT_LT(lit_once, 0.01 * lit);  // outline pixels whose centres fall on an edge
    EXPECT_LT(difference / lit,
              20);  // of 255; the fill light comes from one side. Inside out it would be dark: over 100
}

TEST(Picture, AHiddenObjectIsNotDrawnAndCastsNoShadow) {
    const TemporaryFolder folder;
    render::SceneDescription scene = silhouette_scene({folder.write("box.obj", box_obj())});
    scene.room = {};
    scene.key_light = {};
    const Matrix4f place = (Eigen::Translation3f(0, 0.8f, 0) * Eigen::Scaling(0.3f)).matrix();
    render::Renderer renderer(scene);
    const render::Image shown = picture(renderer, {place}), hidden = picture(renderer, {place}, {false});
    scene.objects.clear();
    render::Renderer empty(scene);
    EXPECT_EQ(hidden.rgb, picture(empty, {}).rgb);
    EXPECT_NE(hidden.rgb, shown.rgb);
}

TEST(Picture, AnEmptySceneIsWallAboveFloorInTheirColours) {
    render::SceneDescription scene;
    scene.camera = {{0, 1, 3}, {0, 0.7f, 0}, 60};
    scene.room = {{0.4f, 0.02f, 0.02f}, {0.02f, 0.02f, 0.4f}, 0};
    render::Renderer renderer(scene);
    const render::Image image = picture(renderer, {});
    ASSERT_EQ(image.rgb.size(), 3u * 640 * 480);
    const std::uint8_t* wall = image.rgb.data() + 3 * (20 * 640 + 320);
    const std::uint8_t* floor = image.rgb.data() + 3 * (440 * 640 + 320);
    EXPECT_GT(wall[2], wall[0] + 30);
    EXPECT_GT(floor[0], floor[2] + 30);
}

/// Looking straight down from 3 m at the floor; world x is right in the picture.
TEST(Picture, TheShadowLiesOnTheFloorWhereTheRaysThroughTheBoxEnd) {
    const TemporaryFolder folder;
    render::SceneDescription scene = silhouette_scene({folder.write("box.obj", box_obj())});
    scene.camera = {{0, 3, 0}, {0, 0, 0}, 50};
    scene.room = {{0.5f, 0.5f, 0.5f}, {0.2f, 0.2f, 0.2f}, 0};
    scene.key_light = {{1, 1, 0}, {1, 1, 1}, 1};
    const Matrix4f box = (Eigen::Translation3f(0, 0.6f, 0) * Eigen::Scaling(0.12f)).matrix();
    const float pixels_per_metre = 0.5f * kHeight / std::tan(25 * std::numbers::pi_v<float> / 180) / 3;
    const int shadow_x = static_cast<int>(
        0.5f * kWidth - 0.6f * pixels_per_metre);  // light from +x at 45 degrees, height 0.6 m
    for (const int shadow_size : {1024, 0}) {
        scene.shadow_size = shadow_size;
        render::Renderer renderer(scene);
        const render::Image with = picture(renderer, {box}), without = picture(renderer, {box}, {false});
        const double in_shadow = brightness(with, shadow_x, kHeight / 2) /
                                 static_cast<double>(brightness(without, shadow_x, kHeight / 2));
        const int other_x = kWidth - 1 - shadow_x;
        const double other = brightness(with, other_x, kHeight / 2) /
                             static_cast<double>(brightness(without, other_x, kHeight / 2));
        if (shadow_size > 0) {
            EXPECT_LT(in_shadow, 0.7);
        } else {
            EXPECT_GT(in_shadow, 0.85);  // only the soft darkening of the sky's light
        }
        EXPECT_GT(other, 0.85);
    }
}

std::string rod_obj() {
    meshgen::ObjMesh mesh{"rod", {}};
    meshgen::tube(mesh.part("rod"), {0, 0, -0.2}, {0, 0, 0.2}, {1, 1}, 16);
    return mesh.text();
}

/// Rods over a floor, at the size and the distance of sticks over a wide kit. A place in the middle of a shadow is as dark
/// as the floor without the key light.
TEST(Picture, TheShadowsOfThinRodsAreSolidAlongTheirWholeMiddle) {
    const TemporaryFolder folder;
    render::SceneDescription scene;
    scene.objects.push_back({.name = "rod",
                             .mesh = folder.write("rod.obj", rod_obj()),
                             .look = {},
                             .shadow = render::Shadow::widened});
    scene.camera = {{0, 2.4f, 2.4f}, {0, 0, 0}, 45};
    const Vector3f light = scene.key_light.towards_light.normalized();
    const auto render_it = [&](const Matrix4f& matrix, bool visible, float strength) {
        scene.key_light.strength = strength;
        render::Renderer renderer(scene);
        return picture(renderer, {matrix}, {visible});
    };
    const render::Image lit = render_it(Matrix4f::Identity(), false, 1),
                        dark = render_it(Matrix4f::Identity(), false, 0);
    const Vector3f back = scene.camera.eye.normalized(), up = back.cross(Vector3f::UnitX());
    const auto pixel = [&](const Vector3f& world) {
        const Vector3f from_eye = world - scene.camera.eye;
        const float scale = 240 / std::tan(22.5f * std::numbers::pi_v<float> / 180) / -from_eye.dot(back);
        return std::pair(static_cast<int>(320 + scale * from_eye.x()),
                         static_cast<int>(240 - scale * from_eye.dot(up)));
    };
    // The smallest share of the key light that the shadow takes along its middle, where the rod does not hide it.
    const auto palest = [&](float radius, float turn, render::Shadow shadow) {
        scene.objects[0].shadow = shadow;
        const Affine3f rod =
            Eigen::Translation3f(0.1f, 0.3f, -0.2f) * Eigen::AngleAxisf(turn, Vector3f::UnitY()) *
            Eigen::AngleAxisf(0.15f, Vector3f::UnitX()) * Eigen::Scaling(radius, radius, 1.0f);
        const render::Image image = render_it(rod.matrix(), true, 1);
        const auto hidden = [&](int x, int y) {
            for (float along = -0.21f; along < 0.21f; along += 0.005f) {
                const auto [rod_x, rod_y] = pixel(rod * Vector3f(0, 0, along));
                if (std::hypot(x - rod_x, y - rod_y) < 200 * radius + 4) return true;
            }
            return false;
        };
        double least = 1;
        int seen = 0;
        for (float along = -0.17f; along < 0.17f; along += 0.004f) {
            const Vector3f axis = rod * Vector3f(0, 0, along);
            const auto [x, y] = pixel(axis - light * (axis.y() / light.y()));
            if (hidden(x, y)) continue;
            ++seen;
            const double from = brightness(lit, x, y), to = brightness(dark, x, y);
            least = std::min(least, (from - brightness(image, x, y)) / (from - to));
        }
        EXPECT_GT(seen, 30) << radius << " m, turned by " << turn;
        return least;
    };
    for (const float turn : {0.1f, 0.5f, 1.0f, 1.7f, 2.9f}) {
        // The widened shadow of a rod of a texel's radius is 4.5 texels wide, the filter reaches 4: a few per cent of light
        // are left where its edge is rounded to texels.
        for (const float radius : {0.005f, 0.006f, 0.01f, 0.02f})
            EXPECT_GT(palest(radius, turn, render::Shadow::widened), 0.85)
                << radius << " m, turned by " << turn;
        EXPECT_LT(palest(0.005f, turn, render::Shadow::cast), 0.85) << "without it, turned by " << turn;
    }
}

TEST(Picture, WhatCastsNoShadowIsSeenAndLeavesTheFloorLit) {
    const TemporaryFolder folder;
    render::SceneDescription scene = silhouette_scene({folder.write("box.obj", box_obj())});
    scene.objects[0].shadow = render::Shadow::none;
    scene.camera = {{0, 3, 0}, {0, 0, 0}, 50};
    scene.room = {{0.5f, 0.5f, 0.5f}, {0.2f, 0.2f, 0.2f}, 0};
    scene.key_light = {{1, 1, 0}, {1, 1, 1}, 1};
    const Matrix4f box = (Eigen::Translation3f(0, 0.6f, 0) * Eigen::Scaling(0.04f)).matrix();
    render::Renderer renderer(scene);
    const render::Image with = picture(renderer, {box}), without = picture(renderer, {box}, {false});
    int changed = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const bool same = brightness(with, x, y) == brightness(without, x, y);
            changed += !same;
            // The box is 8 cm at 2.4 m, 9 pixels to each side; its shadow would lie 60 cm to the left.
            EXPECT_TRUE(same || (std::abs(x - kWidth / 2) < 6 && std::abs(y - kHeight / 2) < 6))
                << x << " " << y;
        }
    EXPECT_GT(changed, 20);
}

TEST(Picture, TheNearerObjectHidesTheFartherInEitherOrder) {
    const TemporaryFolder folder;
    const std::filesystem::path mesh = folder.write("box.obj", box_obj());
    render::SceneDescription scene = silhouette_scene({mesh, mesh});
    scene.objects[0].look.body.color = Vector3f(1, 0, 0);
    scene.objects[1].look.body.color = Vector3f(0, 1, 0);
    render::Renderer renderer(scene);
    const Matrix4f near = (Eigen::Translation3f(0, 1, 1) * Eigen::Scaling(0.2f)).matrix();
    const Matrix4f far = (Eigen::Translation3f(0, 1, -1) * Eigen::Scaling(0.2f)).matrix();
    const std::size_t center = 3 * (kHeight / 2 * kWidth + kWidth / 2);
    const render::Image red = picture(renderer, {near, far}), green = picture(renderer, {far, near});
    EXPECT_GT(red.rgb[center], red.rgb[center + 1] + 50);
    EXPECT_GT(green.rgb[center + 1], green.rgb[center] + 50);
}

TEST(Picture, FramesAndScenesThatMakeNoSenseAreRefused) {
    const TemporaryFolder folder;
    render::SceneDescription scene = silhouette_scene({folder.write("box.obj", box_obj())});
    render::Renderer renderer(scene);
    render::Image image;
    EXPECT_THROW(renderer.draw({}, image), std::invalid_argument);
    const Matrix4f bad = Matrix4f::Constant(std::numeric_limits<float>::quiet_NaN());
    EXPECT_THROW(renderer.draw({{bad}, {true}}, image), std::invalid_argument);
    EXPECT_NO_THROW(renderer.draw({{bad}, {false}}, image));
    scene.width = 0;
    EXPECT_THROW(render::Renderer{scene}, std::runtime_error);
    scene.width = 16;
    scene.camera.target = scene.camera.eye;
    EXPECT_THROW(render::Renderer{scene}, std::runtime_error);
    scene = silhouette_scene({folder.path() / "absent.obj"});
    EXPECT_THROW(render::Renderer{scene}, std::runtime_error);
}

/// A plate on which no shadow can fall, seen from 2 to 60 degrees above it: a shadow map changes no pixel of it.
/// One that its surface shadows by itself would dot it.
TEST(Picture, APlateShadowsNotItselfHoweverFlatItIsSeen) {
    const TemporaryFolder folder;
    render::SceneDescription scene;
    scene.objects.push_back({"plate", folder.write("box.obj", box_obj()), {{{1, 0, 0}, 0, 1}, {}}});
    scene.room.floor_color = scene.room.wall_color = Vector3f::Zero();
    scene.width = 320, scene.height = 240;
    const Matrix4f matrix = (Eigen::Translation3f(0, 0.5f, 0) * Eigen::Scaling(0.6f, 0.05f, 0.6f)).matrix();
    for (const float degrees : {2, 5, 9, 14, 20, 35, 60})
        for (const float around : {0.0f, 0.4f, 2.0f, 4.0f}) {
            const float angle = degrees * 3.14159265f / 180;
            scene.camera.target = {0, 0.55f, 0};
            scene.camera.eye =
                scene.camera.target + 2.5f * Vector3f(std::sin(around) * std::cos(angle), std::sin(angle),
                                                      std::cos(around) * std::cos(angle));
            scene.camera.vertical_fov_deg = 35;
            scene.shadow_size = 0;
            render::Renderer without(scene);
            const render::Image plain = picture(without, {matrix});
            scene.shadow_size = 512;
            render::Renderer with(scene);
            const render::Image shadowed = picture(with, {matrix});
            // Its upper side is the brightest; the others may lie in its shadow. Pixels at its edge are partly of
            // its rounding, which is narrower than they are.
            const auto is_upper = [&](int x, int y) {
                return plain.rgb[static_cast<std::size_t>(3 * (y * scene.width + x))] >= 180;
            };
            int upper = 0, dotted = 0;
            for (int y = 1; y + 1 < scene.height; ++y)
                for (int x = 1; x + 1 < scene.width; ++x) {
                    if (!is_upper(x, y) || !is_upper(x - 1, y) || !is_upper(x + 1, y) ||
                        !is_upper(x, y - 1) || !is_upper(x, y + 1))
                        continue;
                    ++upper;
                    dotted += brightness(shadowed, x, y) != brightness(plain, x, y);
                }
            EXPECT_GT(upper, 100) << degrees << " " << around;
            EXPECT_EQ(dotted, 0) << degrees << " " << around;
        }
}

}  // namespace
