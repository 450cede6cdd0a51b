#include "stage.h"

#include <cmath>
#include <numbers>

#include "render_targets.h"
#include "shaders.h"

namespace render {
namespace {

constexpr int kRings = 30, kSpokes = 56;

/// Radii [m] of the floor's circles: 7 cm apart where things stand, then growing to 7 m, where the floor has
/// faded into the wall.
float ring_radius(int ring) {
    const float x = static_cast<float>(ring) / kRings;
    return 2.1f * x + 4.9f * std::pow(x, 7.0f);
}

std::vector<Eigen::Vector3f> floor_vertices(const Eigen::Vector3f& center) {
    std::vector<Eigen::Vector3f> vertices;
    for (int ring = 0; ring <= kRings; ++ring) {
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(spoke) / kSpokes;
            vertices.push_back(center +
                               ring_radius(ring) * Eigen::Vector3f(std::cos(angle), 0, -std::sin(angle)));
        }
    }
    return vertices;
}

std::vector<GLuint> floor_triangles() {
    std::vector<GLuint> indices;
    for (GLuint ring = 0; ring < kRings; ++ring) {
        for (GLuint spoke = 0; spoke < kSpokes; ++spoke) {
            const GLuint next = (spoke + 1) % kSpokes;
            const GLuint a = ring * kSpokes + spoke, b = ring * kSpokes + next, c = a + kSpokes,
                         d = b + kSpokes;
            if (ring > 0) indices.insert(indices.end(), {a, d, b});
            indices.insert(indices.end(), {a, c, d});
        }
    }
    return indices;
}

}  // namespace

Stage::Stage(const GlFunctions& gl, const SceneDescription& scene)
    : gl_(gl),
      width_(scene.width),
      height_(scene.height),
      floor_bake_(gl, shaders::floor_vertex(), shaders::floor_bake_fragment()),
      backdrop_bake_(gl, shaders::backdrop_vertex(), shaders::backdrop_bake_fragment()),
      floor_(gl, shaders::floor_vertex(), shaders::floor_fragment()),
      backdrop_(gl, shaders::backdrop_vertex(), shaders::backdrop_fragment()),
      lit_texture_(make_color_texture(gl, width_, height_)),
      dark_texture_(make_color_texture(gl, width_, height_)) {
    const Eigen::Vector3f center(scene.camera.target.x(), scene.room.floor_height, scene.camera.target.z());
    make_floor(center);
    floor_bake_.use();
    floor_bake_.set("center", center);
}

void Stage::make_floor(const Eigen::Vector3f& center) {
    const std::vector<Eigen::Vector3f> vertices = floor_vertices(center);
    const std::vector<GLuint> indices = floor_triangles();
    floor_indices_ = static_cast<GLsizei>(indices.size());
    gl_.GenVertexArrays(1, &empty_array_);
    gl_.GenVertexArrays(1, &floor_array_);
    gl_.BindVertexArray(floor_array_);
    GLuint buffers[2];
    gl_.GenBuffers(2, buffers);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof vertices[0]),
                   vertices.data(), GL_STATIC_DRAW);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof indices[0]),
                   indices.data(), GL_STATIC_DRAW);
    gl_.EnableVertexAttribArray(0);
    gl_.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof vertices[0], nullptr);
}

std::vector<const GlProgram*> Stage::programs() const {
    return {&floor_bake_, &backdrop_bake_, &floor_, &backdrop_};
}

void Stage::bake(GLuint lit_unit, GLuint dark_unit) {
    bake_one(lit_texture_, 1);
    bake_one(dark_texture_, 0);
    gl_.ActiveTexture(GL_TEXTURE0 + lit_unit);
    gl_.BindTexture(GL_TEXTURE_2D, lit_texture_);
    gl_.ActiveTexture(GL_TEXTURE0 + dark_unit);
    gl_.BindTexture(GL_TEXTURE_2D, dark_texture_);
}

void Stage::bake_one(GLuint texture, float key_part) const {
    (void)make_framebuffer(gl_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    require_complete(gl_, "background", width_, height_);
    gl_.Viewport(0, 0, width_, height_);
    floor_bake_.use();
    floor_bake_.set("key_part", key_part);
    draw_shapes(backdrop_bake_, floor_bake_);
}

void Stage::draw(const std::vector<Eigen::Vector4f>& balls) const {
    floor_.use();
    floor_.set("balls", balls);
    floor_.set("ball_count", static_cast<int>(balls.size()));
    draw_shapes(backdrop_, floor_);
}

void Stage::draw_shapes(const GlProgram& backdrop, const GlProgram& floor) const {
    backdrop.use();
    gl_.BindVertexArray(empty_array_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    floor.use();
    gl_.BindVertexArray(floor_array_);
    gl_.DrawElements(GL_TRIANGLES, floor_indices_, GL_UNSIGNED_INT, nullptr);
}

}  // namespace render
