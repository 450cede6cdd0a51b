#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "object_bounds.h"
#include "render/renderer.h"
#include "tile_mask.h"

namespace {

using Eigen::Affine3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

const std::string kMeshes = MUSICWORLD_SOURCE_DIR "/assets/meshes/";

float random(std::mt19937& engine, float low, float high) {
    return low + (high - low) * static_cast<float>(engine()) / 4294967296.0f;
}

/// A square plate of 2 m by 2 m that bends by one mode.
render::Solid bending_plate() {
    constexpr int kSide = 9;
    render::MeshPart part;
    render::ModeShapes modes;
    modes.count = 1;
    for (int i = 0; i < kSide * kSide; ++i) {
        const float x = static_cast<float>(i % kSide) / 4 - 1, z = static_cast<float>(i / kSide) / 4 - 1;
        part.positions.emplace_back(x, 0, z);
        part.normals.emplace_back(0, 1, 0);
        modes.displacement.emplace_back(0, std::cos(2 * x) * z, 0);
        Eigen::Matrix3f gradient = Eigen::Matrix3f::Zero();
        gradient.row(1) = Vector3f(-2 * std::sin(2 * x) * z, 0, std::cos(2 * x));
        modes.gradient.push_back(gradient);
    }
    for (std::uint32_t row = 0; row + 1 < kSide; ++row)
        for (std::uint32_t i = row * kSide; i + 1 < (row + 1) * kSide; ++i)
            part.indices.insert(part.indices.end(), {i, i + kSide, i + 1, i + 1, i + kSide, i + kSide + 1});
    return {{{part}}, modes};
}

/// Drums on stands, a cymbal over them, a bending plate and two sticks.
render::SceneDescription stage(int width, int height, int samples, int shadow_size) {
    render::SceneDescription scene;
    for (const char* name : {"drum", "drum", "cymbal", "bell", "stand", "string_frame", "stick", "stick"})
        scene.objects.push_back({name, kMeshes + name + ".obj", {}});
    scene.objects.push_back({"plate", {}, {}, 0});
    scene.solids.push_back(bending_plate());
    scene.width = width, scene.height = height;
    scene.samples = samples, scene.shadow_size = shadow_size;
    return scene;
}

Eigen::Matrix4f somewhere(std::mt19937& engine, float size) {
    Affine3f matrix(
        Eigen::Translation3f(random(engine, -1, 1), random(engine, -0.1f, 1.6f), random(engine, -1, 1)));
    matrix.rotate(Eigen::AngleAxisf(random(engine, -3, 3),
                                    Vector3f(random(engine, -1, 1), 1, random(engine, -1, 1)).normalized()));
    const float mirrored = engine() % 4 == 0 ? -1.0f : 1.0f;
    matrix.scale(Vector3f(mirrored * size, random(engine, 0.2f, 1) * size, size));
    return matrix.matrix();
}

/// Some objects move, a little or to another place, appear, vanish or bend; most stay.
void change(render::FrameState& frame, std::mt19937& engine) {
    for (std::size_t i = 0; i < frame.visible.size(); ++i) {
        const float size = i < 6 ? 0.25f : i < 8 ? 1.0f : 0.2f;
        switch (engine() % 12) {
            case 0:
                frame.world_from_object[i] = somewhere(engine, size);
                break;
            case 1:
                frame.world_from_object[i](1, 3) += random(engine, -0.01f, 0.01f);
                break;
            case 2:
                frame.world_from_object[i](0, 1) += random(engine, -0.05f, 0.05f);
                break;
            case 3:
                frame.visible[i] = !frame.visible[i];
                break;
            case 4:
                if (frame.modal[i].size() == 1) frame.modal[i][0] = random(engine, -1, 1);
                break;
            default:
                break;
        }
    }
}

render::FrameState first_frame(std::mt19937& engine, std::size_t objects) {
    render::FrameState frame;
    for (std::size_t i = 0; i < objects; ++i) {
        frame.world_from_object.push_back(somewhere(engine, i < 6 ? 0.25f : i < 8 ? 1.0f : 0.2f));
        frame.modal.emplace_back(Eigen::VectorXf::Zero(i + 1 == objects ? 1 : 0));
    }
    frame.visible.assign(objects, true);
    return frame;
}

void expect_that_kept_pictures_equal_whole_ones(const render::SceneDescription& scene, unsigned seed,
                                                int frames) {
    render::Renderer keeping(scene), whole(scene);
    std::mt19937 engine(seed);
    render::FrameState frame = first_frame(engine, scene.objects.size());
    render::Image kept, drawn;
    for (int k = 0; k < frames; ++k) {
        keeping.draw(frame, kept);
        whole.forget();
        whole.draw(frame, drawn);
        ASSERT_TRUE(kept.rgb == drawn.rgb) << "frame " << k;
        change(frame, engine);
    }
}

TEST(Redraw, WhatIsKeptEqualsAWholePictureToTheBitWithSamplesAndShadow) {
    expect_that_kept_pictures_equal_whole_ones(stage(163, 117, 4, 256), 1, 200);
}

TEST(Redraw, WhatIsKeptEqualsAWholePictureToTheBitWithoutSamples) {
    expect_that_kept_pictures_equal_whole_ones(stage(200, 93, 1, 300), 2, 100);
}

TEST(Redraw, WhatIsKeptEqualsAWholePictureToTheBitWithoutShadow) {
    expect_that_kept_pictures_equal_whole_ones(stage(131, 150, 4, 0), 3, 100);
}

TEST(Redraw, WhatIsKeptEqualsAWholePictureToTheBitSeenFromWithinTheKitInALowLight) {
    render::SceneDescription scene = stage(150, 110, 4, 256);
    scene.camera = {{0.2f, 0.5f, 0.3f}, {0, 0.4f, -0.5f}, 90};  // objects pass the eye and stand behind it
    scene.key_light.towards_light = {0.9f, 0.25f, 0.7f};
    expect_that_kept_pictures_equal_whole_ones(scene, 4, 100);
}

/// Frames from cameras of their own among frames from the scene's: what was kept from elsewhere shows
/// nowhere.
TEST(Redraw, WhatIsKeptEqualsAWholePictureToTheBitFromACameraThatMoves) {
    const render::SceneDescription scene = stage(140, 100, 4, 256);
    render::Renderer keeping(scene), whole(scene);
    std::mt19937 engine(8);
    render::FrameState frame = first_frame(engine, scene.objects.size());
    render::Image kept, drawn;
    for (int k = 0; k < 60; ++k) {
        if (k % 3 == 0) {
            frame.camera = {{random(engine, -1, 1), 1.4f, random(engine, 1, 2)}, {0, 0.7f, -0.2f}, 50};
            if (k % 2 == 0) frame.camera.reset();
        }
        keeping.draw(frame, kept);
        whole.forget();
        whole.draw(frame, drawn);
        ASSERT_TRUE(kept.rgb == drawn.rgb) << "frame " << k;
        render::Image fresh;
        if (k % 10 == 0) {
            render::Renderer(scene).draw(frame, fresh);
            ASSERT_TRUE(kept.rgb == fresh.rgb)
                << "frame " << k << " of a renderer that has drawn nothing else";
        }
        change(frame, engine);
    }
}

/// From cameras that change, too; now and then pictures are asked for at once.
TEST(Redraw, FramesDrawnWhileTheOneBeforeIsFinishedEqualWholePicturesToTheBit) {
    const render::SceneDescription scene = stage(140, 100, 4, 256);
    render::Renderer ahead(scene), whole(scene);
    std::mt19937 engine(9);
    render::FrameState frame = first_frame(engine, scene.objects.size());
    render::Image before, last, drawn;
    EXPECT_FALSE(ahead.finish(before)) << "nothing was begun";
    bool begun = false;
    for (int k = 0; k < 120; ++k) {
        if (k % 7 == 0) frame.camera = {{random(engine, -1, 1), 1.4f, 1.5f}, {0, 0.7f, -0.2f}, 50};
        if (k % 14 == 0) frame.camera.reset();
        ASSERT_EQ(ahead.draw_next(frame, before), begun) << "frame " << k;
        if (begun) {
            ASSERT_TRUE(before.rgb == drawn.rgb) << "frame " << k - 1;
        }
        whole.forget();
        whole.draw(frame, drawn);
        change(frame, engine);
        begun = k % 10 != 4;
        if (begun) continue;
        ASSERT_TRUE(ahead.finish(last));
        ASSERT_TRUE(last.rgb == drawn.rgb) << "frame " << k;
        ahead.draw(frame, last);
        whole.draw(frame, drawn);
        ASSERT_TRUE(last.rgb == drawn.rgb) << "after frame " << k;
        change(frame, engine);
    }
}

TEST(Redraw, AFrameThatIsRefusedChangesNothing) {
    const render::SceneDescription scene = stage(96, 64, 4, 128);
    render::Renderer renderer(scene);
    std::mt19937 engine(5);
    render::FrameState frame = first_frame(engine, scene.objects.size());
    render::Image before, after;
    renderer.draw(frame, before);
    render::FrameState bad = frame;
    bad.world_from_object[1](0, 0) = std::nanf("");
    EXPECT_THROW(renderer.draw(bad, after), std::invalid_argument);
    bad = frame;
    bad.camera = {{0, 1, 0}, {0, 1, 0}, 50};
    EXPECT_THROW(renderer.draw(bad, after), std::invalid_argument);
    renderer.draw(frame, after);
    EXPECT_TRUE(before.rgb == after.rgb);
}

/// Every point of the polygon lies in a marked tile; no tile is marked that lies farther from it than the
/// growth and a tile's diagonal.
/// In every direction the corners reach as far as the mesh.
TEST(ObjectBounds, CornersReachAsFarAsTheMeshInEveryDirectionAndNoFartherThanItsBox) {
    std::mt19937 engine(6);
    for (const char* name : {"drum", "cymbal", "bell", "stand", "string_frame", "stick", "mallet"}) {
        const render::Mesh mesh = render::load_mesh(kMeshes + name + ".obj");
        const std::vector<Vector3f> corners = render::corners_around(mesh);
        EXPECT_GE(corners.size(), 8U);
        const Vector3f half = mesh.bounds().sizes() / 2, center = mesh.bounds().center();
        for (int k = 0; k < 200; ++k) {
            // Of the box scaled to a cube, so that flat and long meshes count as round ones.
            const Vector3f direction =
                Vector3f(random(engine, -1, 1), random(engine, -1, 1), random(engine, -1, 1))
                    .cwiseQuotient(half);
            float reach = -INFINITY, farthest = -INFINITY;
            for (const Vector3f& corner : corners) reach = std::max(reach, direction.dot(corner - center));
            for (const render::MeshPart& part : mesh.parts)
                for (const Vector3f& vertex : part.positions)
                    farthest = std::max(farthest, direction.dot(vertex - center));
            ASSERT_GE(reach, farthest) << name;
            const float of_box = direction.cwiseAbs().dot(half);
            ASSERT_LE(reach, 1.01f * of_box) << name;  // grown by 0.3 %
        }
    }
}

TEST(ObjectBounds, OfAFlatMeshAreItsBox) {
    EXPECT_EQ(render::corners_around(bending_plate().mesh).size(), 8U);
}

TEST(TileMask, MarksTheTilesOfATriangleAndNoneFarFromIt) {
    std::mt19937 engine(6);
    for (int k = 0; k < 200; ++k) {
        render::TileMask mask(150, 100);
        std::vector<Vector2f> corners;
        for (int i = 0; i < 3; ++i) corners.emplace_back(random(engine, -40, 190), random(engine, -40, 140));
        const std::vector<Vector2f> hull = render::convex_hull(corners);
        mask.add(hull);
        std::vector<bool> marked(150 * 100);
        for (const render::PixelBox& box : mask.runs())
            for (int y = box.bottom; y < box.top; ++y)
                for (int x = box.left; x < box.right; ++x)
                    marked[static_cast<std::size_t>(150 * y + x)] = true;
        for (int y = 0; y < 100; ++y)
            for (int x = 0; x < 150; ++x) {
                float outside = 0;  // how far beyond an edge
                const Vector2f p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
                for (std::size_t i = 0; i < hull.size(); ++i) {
                    const Vector2f edge = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
                    outside = std::max(outside, Vector2f(edge.y(), -edge.x()).dot(p - hull[i]));
                }
                const bool is_marked = marked[static_cast<std::size_t>(150 * y + x)];
                ASSERT_TRUE(is_marked || outside > 0) << k << ": " << x << " " << y;
                const float far = 1.5f * render::TileMask::kTile + 3 * render::TileMask::kGrown;
                ASSERT_FALSE(is_marked && outside > far) << k << ": " << x << " " << y;
            }
    }
}

TEST(ConvexHull, OfAGridIsItsFourCorners) {
    std::vector<Vector2f> points;
    for (int i = 0; i < 25; ++i) points.emplace_back(i % 5, i / 5);
    const std::vector<Vector2f> hull = render::convex_hull(points);
    ASSERT_EQ(hull.size(), 4u);
    EXPECT_EQ(hull[0], Vector2f(0, 0));
    EXPECT_EQ(hull[1], Vector2f(4, 0));
    EXPECT_EQ(hull[2], Vector2f(4, 4));
    EXPECT_EQ(hull[3], Vector2f(0, 4));
}

}  // namespace
