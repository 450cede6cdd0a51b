#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <stdexcept>

#include "render/renderer.h"

namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

/// A ball of radius 0.5 m around the origin, made of values.
render::Mesh ball(int meridians = 48, int parallels = 31) {
    render::MeshPart part;
    for (int j = 0; j <= parallels; ++j) {
        for (int i = 0; i < meridians; ++i) {
            const float theta = std::numbers::pi_v<float> * float(j) / float(parallels);
            const float phi = 2 * std::numbers::pi_v<float> * float(i) / float(meridians);
            part.normals.push_back(
                {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
            part.positions.push_back(0.5f * part.normals.back());
        }
    }
    for (int j = 0; j < parallels; ++j) {
        for (int i = 0; i < meridians; ++i) {
            const auto at = [&](int row, int k) { return std::uint32_t(row * meridians + k % meridians); };
            part.indices.insert(part.indices.end(), {at(j, i), at(j, i + 1), at(j + 1, i + 1)});
            part.indices.insert(part.indices.end(), {at(j, i), at(j + 1, i + 1), at(j + 1, i)});
        }
    }
    return {{part}};
}

/// Mode k of five: a quadratic displacement, bending and stretching, as those of a 27-node brick.
Vector3f shape(int k, const Vector3f& r) {
    switch (k) {
        case 0:
            return {r.y() * r.y(), 0, 0};
        case 1:
            return {0, r.x() * r.x() - r.z() * r.y(), 0};
        case 2:
            return {r.x(), -0.5f * r.y(), 0};
        case 3:
            return {r.z() * r.y(), 0, r.x() * r.y()};
        default:
            return {0, 0.3f * r.z(), r.z() * r.z()};
    }
}

Matrix3f gradient(int k, const Vector3f& r) {
    Matrix3f g;
    constexpr float h = 0.01f;  // central differences of a quadratic are exact but for rounding
    for (int axis = 0; axis < 3; ++axis) {
        const Vector3f step = h * Vector3f::Unit(axis);
        g.col(axis) = (shape(k, r + step) - shape(k, r - step)) / (2 * h);
    }
    return g;
}

render::ModeShapes shapes(const render::Mesh& mesh, int count) {
    render::ModeShapes modes;
    modes.count = count;
    for (const render::MeshPart& part : mesh.parts) {
        for (const Vector3f& r : part.positions) {
            for (int k = 0; k < count; ++k) {
                modes.displacement.push_back(shape(k, r));
                modes.gradient.push_back(gradient(k, r));
            }
        }
    }
    return modes;
}

/// Mean difference of 8-bit values. The floor is darkened by a ball of the mesh's volume at rest, which the
/// oracle's meshes do not have: one level in twenty values. Edges of triangles move by a millionth of a
/// pixel.
constexpr double kAlike = 0.1;

/// The oracle: positions moved here, normals through the inverse transpose of I + G. `bend_normals` false
/// leaves them at rest.
render::Mesh deformed(render::Mesh mesh, const Eigen::VectorXf& q, bool bend_normals = true) {
    for (render::MeshPart& part : mesh.parts) {
        for (std::size_t v = 0; v < part.positions.size(); ++v) {
            const Vector3f r = part.positions[v];
            Matrix3f map = Matrix3f::Identity();
            for (int k = 0; k < q.size(); ++k) {
                part.positions[v] += q[k] * shape(k, r);
                map += q[k] * gradient(k, r);
            }
            if (bend_normals) part.normals[v] = (map.inverse().transpose() * part.normals[v]).normalized();
        }
    }
    return mesh;
}

render::SceneDescription scene_of(std::vector<render::Solid> solids) {
    render::SceneDescription scene;
    scene.camera = {{0, 1.1f, 2.6f}, {0, 0.7f, 0}, 36};
    scene.width = 240;
    scene.height = 200;
    for (std::size_t i = 0; i < solids.size(); ++i)
        scene.objects.push_back({"solid", "", {{{0.8f, 0.3f, 0.2f}, 0, 1}, {}}, int(i)});
    scene.solids = std::move(solids);
    return scene;
}

Eigen::Matrix4f placed(float x) {
    const Eigen::Affine3f pose =
        Eigen::Translation3f(x, 0.75f, 0) * Eigen::AngleAxisf(0.6f, Vector3f(1, 2, 0.5f).normalized());
    return pose.matrix();
}

render::Image draw(const render::SceneDescription& scene, const render::FrameState& frame) {
    render::Renderer renderer(scene);
    render::Image image;
    renderer.draw(frame, image);
    return image;
}

struct Difference {
    int largest = 0;
    double mean = 0;
};

Difference difference(const render::Image& a, const render::Image& b) {
    Difference result;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
        const int d = std::abs(int(a.rgb[i]) - int(b.rgb[i]));
        result.largest = std::max(result.largest, d);
        result.mean += d / double(a.rgb.size());
    }
    return result;
}

const Eigen::VectorXf kBent = (Eigen::VectorXf(5) << 0.7f, -0.6f, 0.25f, 0.5f, -0.3f).finished();

TEST(ModalBody, BentByTheShaderLooksLikeTheMeshBentOnTheProcessor) {
    const render::Mesh rest = ball();
    const render::Image shader = draw(scene_of({{rest, shapes(rest, 5)}}), {{placed(0)}, {true}, {kBent}});
    const render::Image processor = draw(scene_of({{deformed(rest, kBent), {}}}), {{placed(0)}, {true}});
    const render::Image stiff = draw(scene_of({{rest, {}}}), {{placed(0)}, {true}});
    EXPECT_LT(difference(shader, processor).mean, kAlike);
    EXPECT_GT(difference(shader, stiff).mean, 2);
}

TEST(ModalBody, NormalsOfTheRestShapeWouldShadeADifferentPicture) {
    const render::Mesh rest = ball();
    const render::Image shader = draw(scene_of({{rest, shapes(rest, 5)}}), {{placed(0)}, {true}, {kBent}});
    const render::Image wrong = draw(scene_of({{deformed(rest, kBent, false), {}}}), {{placed(0)}, {true}});
    EXPECT_GT(difference(shader, wrong).mean, 1);  // the test above sees normals, not places alone
}

TEST(ModalBody, StretchedByAModeLooksLikeStretchedByTheMatrix) {
    const render::Mesh rest = ball();
    Eigen::VectorXf q = Eigen::VectorXf::Zero(5);
    q[2] = 0.5f;
    Eigen::Matrix4f stretched = placed(0);
    stretched.leftCols<3>() *= Vector3f(1.5f, 0.75f, 1).asDiagonal();
    const render::Image modes = draw(scene_of({{rest, shapes(rest, 5)}}), {{placed(0)}, {true}, {q}});
    const render::Image matrix = draw(scene_of({{rest, {}}}), {{stretched}, {true}});
    EXPECT_LT(difference(modes, matrix).mean, kAlike);
}

TEST(ModalBody, BendingAndRigidSolidsOfDifferentCountsShareAScene) {
    const render::Mesh rest = ball();
    const Eigen::VectorXf two = kBent.head(2), none;
    render::SceneDescription scene = scene_of({{rest, shapes(rest, 5)}, {rest, {}}, {rest, shapes(rest, 2)}});
    scene.objects[1].solid = 2;  // the order of solids is not that of objects
    scene.objects[2].solid = 1;
    const render::FrameState frame{
        {placed(-0.9f), placed(0), placed(0.9f)}, {true, true, true}, {kBent, two, none}};
    const render::Image shader = draw(scene, frame);
    const render::Image processor =
        draw(scene_of({{deformed(rest, kBent), {}}, {deformed(rest, two), {}}, {rest, {}}}),
             {frame.world_from_object, frame.visible});
    EXPECT_LT(difference(shader, processor).mean, kAlike);
}

TEST(ModalBody, AtRestAMeshOfValuesAndABendingOneGiveTheSamePicture) {
    const render::Mesh rest = ball();
    const render::Image values = draw(scene_of({{rest, {}}}), {{placed(0)}, {true}});
    const render::Image bending =
        draw(scene_of({{rest, shapes(rest, 5)}}), {{placed(0)}, {true}, {Eigen::VectorXf::Zero(5)}});
    EXPECT_LT(difference(values, bending).mean, 0.005);  // rounding alone
    EXPECT_GT(difference(values, draw(scene_of({{rest, {}}}), {{placed(0)}, {false}})).mean, 5);
}

TEST(ModalBody, CoordinatesAndShapesThatDoNotFitAreRefused) {
    const render::Mesh rest = ball();
    render::Renderer renderer(scene_of({{rest, shapes(rest, 5)}}));
    render::Image image;
    EXPECT_THROW(renderer.draw({{placed(0)}, {true}}, image), std::invalid_argument);
    EXPECT_THROW(renderer.draw({{placed(0)}, {true}, {kBent.head(4)}}, image), std::invalid_argument);
    Eigen::VectorXf broken = kBent;
    broken[3] = std::nanf("");
    EXPECT_THROW(renderer.draw({{placed(0)}, {true}, {broken}}, image), std::invalid_argument);

    render::ModeShapes few = shapes(rest, 5);
    few.gradient.pop_back();
    EXPECT_THROW(render::Renderer(scene_of({{rest, few}})), std::runtime_error);
    render::SceneDescription missing = scene_of({{rest, {}}});
    missing.objects[0].solid = 1;
    EXPECT_THROW(render::Renderer{missing}, std::runtime_error);
}

}  // namespace
