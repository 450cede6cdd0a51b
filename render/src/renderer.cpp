#include "render/renderer.h"

#include <stdexcept>

#include "gl_functions.h"
#include "gl_program.h"
#include "osmesa_context.h"
#include "render_targets.h"
#include "scene_geometry.h"
#include "shaders.h"
#include "stage.h"
#include "view.h"

namespace render {
namespace {

constexpr GLuint kMatrixUnit = 0, kShadowUnit = 1, kObjectsUnit = 2, kLitUnit = 3, kDarkUnit = 4,
                 kModesUnit = 5;
constexpr int kMostPixels = 8192;  // pixels

SceneDescription checked(const SceneDescription& scene) {
    if (scene.width < 1 || scene.height < 1 || scene.width > kMostPixels || scene.height > kMostPixels) {
        throw std::runtime_error("picture: error: found a size of " + std::to_string(scene.width) + "x" +
                                 std::to_string(scene.height) + ", expected 1x1 to 8192x8192");
    }
    if (scene.shadow_size < 0 || scene.shadow_size > kMostPixels) {
        throw std::runtime_error("shadow: error: found a size of " + std::to_string(scene.shadow_size) +
                                 ", expected 0 to 8192");
    }
    const Camera& camera = scene.camera;
    const bool looks =
        camera.eye.allFinite() && camera.target.allFinite() && (camera.target - camera.eye).norm() > 1e-6f;
    if (!looks || !(camera.vertical_fov_deg >= 1 && camera.vertical_fov_deg <= 150)) {
        throw std::runtime_error(
            "camera: error: found eye, target or field of view out of range, expected two places and 1 to "
            "150 degrees");
    }
    if (!scene.key_light.towards_light.allFinite() || scene.key_light.towards_light.norm() < 1e-6f) {
        throw std::runtime_error("key light: error: found no direction, expected one");
    }
    return scene;
}

}  // namespace

struct Renderer::Implementation {
    explicit Implementation(const SceneDescription& description);

    DrawTimes draw(const FrameState& frame, Image& image);
    void set_uniforms(const GlProgram& program) const;

    SceneDescription scene;
    OsmesaContext context;
    GlFunctions gl;
    Eigen::Matrix4f clip, light;  ///< clip space of the camera and of the light, from world
    float texel;                  ///< of the shadow map [m]
    PictureTarget picture;
    ShadowTarget shadow;
    SceneGeometry geometry;
    GlProgram shadow_program, object_program;
    Stage stage;
};

Renderer::Implementation::Implementation(const SceneDescription& description)
    : scene(checked(description)),
      picture(gl, scene.width, scene.height, scene.samples),
      shadow(gl, scene.shadow_size),
      geometry(gl, scene),
      shadow_program(gl, shaders::shadow_vertex(geometry.bends()), shaders::shadow_fragment()),
      object_program(gl, shaders::object_vertex(geometry.bends()),
                     shaders::object_fragment(!scene.solids.empty())),
      stage(gl, scene) {
    const float aspect = static_cast<float>(scene.width) / static_cast<float>(scene.height);
    const float reach = shadow_reach(scene.camera, aspect);
    clip = clip_from_world(scene.camera, aspect);
    light = light_from_world(scene.key_light, scene.camera.target, reach);
    texel = scene.shadow_size > 0 ? 2 * reach / static_cast<float>(scene.shadow_size) : 0;
    gl.Enable(GL_CULL_FACE);
    gl.DepthFunc(GL_LEQUAL);
    gl.PolygonOffset(1.5f, 2.0f);  // shadow map only
    set_uniforms(object_program);
    for (const GlProgram* program : stage.programs()) set_uniforms(*program);
    gl.Disable(GL_DEPTH_TEST);
    stage.bake(kLitUnit, kDarkUnit);
    shadow_program.use();
    shadow_program.set("matrices", static_cast<int>(kMatrixUnit));
    shadow_program.set("modes", static_cast<int>(kModesUnit));
    shadow_program.set("clip_from_light_world", light);
}

void Renderer::Implementation::set_uniforms(const GlProgram& program) const {
    const Room& room = scene.room;
    const KeyLight& key = scene.key_light;
    const auto width = static_cast<float>(scene.width), height = static_cast<float>(scene.height);
    const Eigen::Affine3f to_texture = Eigen::Translation3f(0.5f, 0.5f, 0.5f) * Eigen::Scaling(0.5f);
    const Eigen::Vector3f key_light = 1.9f * key.strength * key.color;
    program.use();
    program.set("picture", Eigen::Vector3f(width, height, 4 / (width * width + height * height)));
    program.set("clip_from_world", clip);
    program.set("shadow_from_world", Eigen::Matrix4f(to_texture.matrix() * light));
    program.set("shadow_map", static_cast<int>(kShadowUnit));
    program.set("shadow_texel", scene.shadow_size > 0 ? 1 / static_cast<float>(scene.shadow_size) : 0.0f);
    program.set("shadow_offset", 1.5f * texel);
    program.set("matrices", static_cast<int>(kMatrixUnit));
    program.set("modes", static_cast<int>(kModesUnit));
    program.set("objects", static_cast<int>(kObjectsUnit));
    program.set("lit_floor", static_cast<int>(kLitUnit));
    program.set("dark_floor", static_cast<int>(kDarkUnit));
    program.set("floor_color", room.floor_color);
    program.set("wall_color", room.wall_color);
    program.set("floor_height", room.floor_height);
    program.set("eye", scene.camera.eye);
    program.set("towards_light", Eigen::Vector3f(key.towards_light.normalized()));
    program.set("key_light", key_light);
    program.set("sky_light", Eigen::Vector3f(0.13f, 0.13f, 0.15f));
    program.set("ground_light", Eigen::Vector3f(0.03f * Eigen::Vector3f::Ones() +
                                                0.10f * room.floor_color.cwiseProduct(key_light)));
    program.set("fill_light", Eigen::Vector3f(0.07f, 0.085f, 0.13f));
}

DrawTimes Renderer::Implementation::draw(const FrameState& frame, Image& image) {
    context.make_current();
    geometry.update(frame, scene.camera.eye);
    gl.Enable(GL_DEPTH_TEST);
    if (scene.shadow_size > 0) {
        shadow.begin();
        gl.Enable(GL_POLYGON_OFFSET_FILL);
        gl.Enable(GL_DEPTH_CLAMP);  // what is nearer to the light than the map's depth still casts
        shadow_program.use();
        geometry.draw(kMatrixUnit, kModesUnit);
        gl.Disable(GL_DEPTH_CLAMP);
        gl.Disable(GL_POLYGON_OFFSET_FILL);
    }
    shadow.bind(kShadowUnit);
    picture.begin_objects();
    object_program.use();
    gl.Enable(
        GL_CLIP_DISTANCE0);  // the floor, which is laid under the objects afterwards, hides what is below it
    geometry.draw(kMatrixUnit, kModesUnit);
    gl.Disable(GL_CLIP_DISTANCE0);
    gl.Disable(GL_DEPTH_TEST);
    picture.begin_background(kObjectsUnit);
    stage.draw(geometry.volume_balls(shaders::kMaxBalls));
    DrawTimes times;
    gl.Finish();
    times.drawn = std::chrono::steady_clock::now();
    picture.read(image);
    times.read = std::chrono::steady_clock::now();
    return times;
}

Renderer::Renderer(const SceneDescription& scene)
    : implementation_(std::make_unique<Implementation>(scene)) {}

Renderer::~Renderer() = default;

DrawTimes Renderer::draw(const FrameState& frame, Image& image) {
    return implementation_->draw(frame, image);
}

std::string Renderer::version() const {
    implementation_->context.make_current();
    const auto text = [this](GLenum name) {
        return std::string(reinterpret_cast<const char*>(implementation_->gl.GetString(name)));
    };
    return "OSMesa, OpenGL " + text(GL_VERSION) + ", " + text(GL_RENDERER);
}

std::size_t Renderer::triangles() const {
    return implementation_->geometry.triangles();
}

}  // namespace render
