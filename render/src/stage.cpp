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

Stage::Stage(const GlFunctions& gl, const SceneDescription& scene,
             const std::vector<Eigen::Vector4f>& sample_places)
    : gl_(gl),
      width_(scene.width),
      height_(scene.height),
      floor_bake_(gl, shaders::floor_vertex(), shaders::floor_bake_fragment()),
      backdrop_bake_(gl, shaders::backdrop_vertex(), shaders::backdrop_bake_fragment()),
      open_(gl, shaders::floor_vertex(), shaders::floor_open_fragment()),
      background_(gl, shaders::tile_vertex(), shaders::background_fragment()),
      picture_(gl, shaders::tile_vertex(),
               shaders::picture_fragment(!sample_places.empty(), !scene.solids.empty())),
      lit_texture_(make_texture(gl, GL_RGBA8, width_, height_)),
      dark_texture_(make_texture(gl, GL_RGBA8, width_, height_)),
      open_texture_(make_texture(gl, GL_R32F, width_, height_)),
      lit_framebuffer_(framebuffer_of(lit_texture_)),
      dark_framebuffer_(framebuffer_of(dark_texture_)),
      open_framebuffer_(framebuffer_of(open_texture_)) {
    const Eigen::Vector3f center(scene.camera.target.x(), scene.room.floor_height, scene.camera.target.z());
    make_floor(center);
    floor_bake_.use();
    floor_bake_.set("center", center);
    picture_.use();
    picture_.set("sample_xy", sample_places);
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
    return {&floor_bake_, &backdrop_bake_, &open_, &background_, &picture_};
}

GLuint Stage::framebuffer_of(GLuint texture) const {
    const GLuint framebuffer = make_framebuffer(gl_);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    require_complete(gl_, "background", width_, height_);
    return framebuffer;
}

void Stage::begin(GLuint framebuffer) const {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl_.Viewport(0, 0, width_, height_);
}

void Stage::bake(const Eigen::Matrix4f& clip_from_world, GLuint lit_unit, GLuint dark_unit,
                 GLuint open_unit) {
    bake_one(lit_framebuffer_, 1);
    bake_one(dark_framebuffer_, 0);
    balls_.reset();
    const auto bind = [this](GLuint unit, GLuint texture) {
        gl_.ActiveTexture(GL_TEXTURE0 + unit);
        gl_.BindTexture(GL_TEXTURE_2D, texture);
    };
    bind(lit_unit, lit_texture_);
    bind(dark_unit, dark_texture_);
    bind(open_unit, open_texture_);
    set_rays(background_, clip_from_world);
    set_rays(picture_, clip_from_world);
    // The third row of the matrix is -a times the fourth and, in its last place, b more: at a distance d along the view
    // the window's depth is w = (1 - a + b / d) / 2.
    const Eigen::RowVector4d third = clip_from_world.row(2).cast<double>(),
                             fourth = clip_from_world.row(3).cast<double>();
    const double a = -third.head<3>().dot(fourth.head<3>()) / fourth.head<3>().squaredNorm();
    picture_.set("depth_from_window",
                 Eigen::Vector2f(static_cast<float>(1 - a), static_cast<float>(third[3] + a * fourth[3])));
}

void Stage::set_rays(const GlProgram& program, const Eigen::Matrix4f& clip_from_world) const {
    // The ray of a pixel is where it meets the plane at distance 1 (w = 1), from the eye.
    const Eigen::Matrix3d world_from_clip =
        (Eigen::Matrix3d() << clip_from_world.block<2, 3>(0, 0).cast<double>(),
         clip_from_world.block<1, 3>(3, 0).cast<double>())
            .finished()
            .inverse();
    program.use();
    program.set("ray", Eigen::Vector3f((world_from_clip * Eigen::Vector3d(-1, -1, 1)).cast<float>()));
    program.set("ray_x", Eigen::Vector3f((world_from_clip.col(0) * 2 / width_).cast<float>()));
    program.set("ray_y", Eigen::Vector3f((world_from_clip.col(1) * 2 / height_).cast<float>()));
    program.set("depth", 0.5f);
}

void Stage::bake_one(GLuint framebuffer, float key_part) const {
    begin(framebuffer);
    backdrop_bake_.use();
    gl_.BindVertexArray(empty_array_);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    floor_bake_.use();
    floor_bake_.set("key_part", key_part);
    draw_floor();
}

bool Stage::darken(const std::vector<Eigen::Vector4f>& balls) {
    if (balls_ == balls) return false;
    balls_ = balls;
    begin(open_framebuffer_);
    gl_.ClearColor(1, 1, 1, 1);
    gl_.Clear(GL_COLOR_BUFFER_BIT);
    open_.use();
    open_.set("balls", balls);
    open_.set("ball_count", static_cast<int>(balls.size()));
    draw_floor();
    return true;
}

void Stage::draw(const TileQuads& tiles) const {
    picture_.use();
    tiles.draw();
}

void Stage::draw_background(const TileQuads& tiles) const {
    background_.use();
    tiles.draw();
}

void Stage::draw_floor() const {
    gl_.BindVertexArray(floor_array_);
    gl_.DrawElements(GL_TRIANGLES, floor_indices_, GL_UNSIGNED_INT, nullptr);
}

}  // namespace render
