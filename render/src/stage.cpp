#include "stage.h"

#include <cmath>
#include <numbers>

#include "shaders.h"

namespace render {
namespace {

constexpr int kRings = 30, kSpokes = 56;

/// Radii [m] of the floor's circles: 7 cm apart where things stand, then growing to 40 m.
float ring_radius(int ring) {
    const float x = static_cast<float>(ring) / kRings;
    return 2.1f * x + 37.9f * std::pow(x, 7.0f);
}

std::vector<Eigen::Vector3f> floor_vertices(const Eigen::Vector3f& center) {
    std::vector<Eigen::Vector3f> vertices;
    for (int ring = 0; ring <= kRings; ++ring) {
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(spoke) / kSpokes;
            vertices.push_back(center + ring_radius(ring) * Eigen::Vector3f(std::cos(angle), 0, -std::sin(angle)));
        }
    }
    return vertices;
}

std::vector<GLuint> floor_triangles() {
    std::vector<GLuint> indices;
    for (GLuint ring = 0; ring < kRings; ++ring) {
        for (GLuint spoke = 0; spoke < kSpokes; ++spoke) {
            const GLuint next = (spoke + 1) % kSpokes;
            const GLuint a = ring * kSpokes + spoke, b = ring * kSpokes + next, c = a + kSpokes, d = b + kSpokes;
            if (ring > 0) indices.insert(indices.end(), {a, d, b});
            indices.insert(indices.end(), {a, c, d});
        }
    }
    return indices;
}

}  // namespace

Stage::Stage(const GlFunctions& gl, const SceneDescription& scene)
    : gl_(gl),
      floor_program_(gl, shaders::floor_vertex(), shaders::floor_fragment()),
      backdrop_program_(gl, shaders::backdrop_vertex(), shaders::backdrop_fragment()) {
    const Eigen::Vector3f center(scene.camera.target.x(), scene.room.floor_height, scene.camera.target.z());
    const std::vector<Eigen::Vector3f> vertices = floor_vertices(center);
    const std::vector<GLuint> indices = floor_triangles();
    floor_indices_ = static_cast<GLsizei>(indices.size());
    gl_.GenVertexArrays(1, &empty_array_);
    gl_.GenVertexArrays(1, &floor_array_);
    gl_.BindVertexArray(floor_array_);
    GLuint buffers[2];
    gl_.GenBuffers(2, buffers);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof vertices[0]), vertices.data(), GL_STATIC_DRAW);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof indices[0]), indices.data(), GL_STATIC_DRAW);
    gl_.EnableVertexAttribArray(0);
    gl_.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof vertices[0], nullptr);
    floor_program_.use();
    floor_program_.set("floor_color", scene.room.floor_color);
    floor_program_.set("center", center);
    floor_program_.set("wall_color", scene.room.wall_color);
    backdrop_program_.use();
    backdrop_program_.set("wall_color", scene.room.wall_color);
}

void Stage::draw(const std::vector<Eigen::Vector4f>& balls) const {
    floor_program_.use();
    floor_program_.set("balls", balls);
    floor_program_.set("ball_count", static_cast<int>(balls.size()));
    gl_.BindVertexArray(floor_array_);
    gl_.DrawElements(GL_TRIANGLES, floor_indices_, GL_UNSIGNED_INT, nullptr);
    backdrop_program_.use();
    gl_.BindVertexArray(empty_array_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace render
