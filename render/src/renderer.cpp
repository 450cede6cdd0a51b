#include "render/renderer.h"

#include <optional>
#include <stdexcept>

#include "changes.h"
#include "gl_context.h"
#include "gl_functions.h"
#include "gl_program.h"
#include "render_targets.h"
#include "scene_geometry.h"
#include "shaders.h"
#include "stage.h"
#include "tile_mask.h"
#include "view.h"

namespace render {
namespace {

constexpr GLuint kMatrixUnit = 0, kShadowUnit = 1, kSurfacesUnit = 2, kLitUnit = 3, kDarkUnit = 4,
                 kModesUnit = 5, kOpenUnit = 6, kDepthsUnit = 7, kPartsUnit = 8, kNormalsUnit = 9;
/// Balls of a radius below this share of the distance from the eye to the target do not darken the floor
/// beneath them: it would be little, unless they lie on it.
constexpr float kLeastBall = 0.02f;
constexpr float kShadowShift = 2.5f;  // of a receiver along its normal, more than the filter reaches [texels]
constexpr int kMostPixels = 8192;     // pixels

bool looks_somewhere(const Camera& camera) {
    return camera.eye.allFinite() && camera.target.allFinite() && camera.up.allFinite() &&
           camera.up.norm() > 1e-6f && (camera.target - camera.eye).norm() > 1e-6f &&
           camera.vertical_fov_deg >= 1 && camera.vertical_fov_deg <= 150;
}
constexpr const char* kBadCamera =
    "camera: error: found eye, target, up or field of view out of range, expected two places, a "
    "direction and 1 to 150 degrees";

SceneDescription checked(const SceneDescription& scene) {
    if (scene.width < 1 || scene.height < 1 || scene.width > kMostPixels || scene.height > kMostPixels) {
        throw std::runtime_error("picture: error: found a size of " + std::to_string(scene.width) + "x" +
                                 std::to_string(scene.height) + ", expected 1x1 to 8192x8192");
    }
    if (scene.shadow_size < 0 || scene.shadow_size > kMostPixels) {
        throw std::runtime_error("shadow: error: found a size of " + std::to_string(scene.shadow_size) +
                                 ", expected 0 to 8192");
    }
    if (!looks_somewhere(scene.camera)) throw std::runtime_error(kBadCamera);
    if (!scene.key_light.towards_light.allFinite() || scene.key_light.towards_light.norm() < 1e-6f) {
        throw std::runtime_error("key light: error: found no direction, expected one");
    }
    return scene;
}

}  // namespace

struct Renderer::Implementation {
    explicit Implementation(const SceneDescription& description);

    void begin(const FrameState& frame);
    void shade();
    DrawTimes draw(const FrameState& frame, Image& image);
    bool draw_next(const FrameState& frame, Image& before);
    bool finish(Image& image);
    [[nodiscard]] Views views() const;
    void look_from(const Camera& from);
    void draw_shadow();
    void draw_objects();
    void draw_picture(const TileMask& tiles);
    void set_uniforms(const GlProgram& program) const;

    SceneDescription scene;
    Camera camera;
    GlContext context;
    GlFunctions gl{context};
    Eigen::Matrix4f clip, light;  ///< clip space of the camera and of the light, from world
    Eigen::Matrix4f on_map;  ///< of the shadow map: texture coordinates and depth, all in [0, 1], from world
    float texel;             ///< of the shadow map [m], 0: no shadow
    bool multisampling;
    PictureTarget picture;
    ShadowTarget shadow;
    SceneGeometry geometry;
    GlProgram shadow_program, object_program;
    Stage stage;
    Changes changes;
    std::optional<PixelBox> shaded;  ///< of the picture: where it was drawn since it was read
};

namespace {

float aspect_of(const SceneDescription& scene) {
    return static_cast<float>(scene.width) / static_cast<float>(scene.height);
}

/// Of the shadow map [m].
float texel_of(const SceneDescription& scene) {
    if (scene.shadow_size == 0) return 0;
    return 2 * shadow_reach(scene.camera, aspect_of(scene)) / static_cast<float>(scene.shadow_size);
}

}  // namespace

Renderer::Implementation::Implementation(const SceneDescription& description)
    : scene(checked(description)),
      camera(scene.camera),
      clip(clip_from_world(scene.camera, aspect_of(scene))),
      light(light_from_world(scene.key_light, scene.camera.target,
                             shadow_reach(scene.camera, aspect_of(scene)))),
      on_map((Eigen::Translation3f(0.5f, 0.5f, 0.5f) * Eigen::Scaling(0.5f)).matrix() * light),
      texel(texel_of(scene)),
      multisampling(scene.samples > 1),
      picture(gl, scene.width, scene.height, multisampling),
      shadow(gl, scene.shadow_size),
      geometry(gl, scene, shaders::kShadowWidening * texel),
      shadow_program(gl, shaders::shadow_vertex(geometry.bends()), shaders::shadow_fragment()),
      object_program(gl, shaders::object_vertex(geometry.bends()), shaders::object_fragment()),
      stage(gl, scene, picture.sample_places()),
      changes(views(), geometry.bounds()) {
    gl.Enable(GL_CULL_FACE);
    gl.DepthFunc(GL_LESS);
    gl.PolygonOffset(1.5f, 2.0f);  // shadow map only
    gl.Disable(GL_DEPTH_TEST);
    look_from(scene.camera);
    shadow_program.use();
    shadow_program.set("matrices", static_cast<int>(kMatrixUnit));
    shadow_program.set("modes", static_cast<int>(kModesUnit));
    shadow_program.set("clip_from_light_world", light);
    shadow.bind(kShadowUnit);
    geometry.bind_parts(kPartsUnit);
    picture.bind(kNormalsUnit, kSurfacesUnit, kDepthsUnit);
}

Views Renderer::Implementation::views() const {
    return {clip,
            light,
            scene.width,
            scene.height,
            scene.shadow_size,
            scene.room.floor_height,
            shaders::kShadowFilter,
            kShadowShift * texel,
            shaders::kPlaceError,
            shaders::kShadowWidening};
}

/// Of what was drawn from elsewhere the shadow map is kept.
void Renderer::Implementation::look_from(const Camera& from) {
    camera = from;
    clip = clip_from_world(camera, aspect_of(scene));
    changes.look_from(clip);
    set_uniforms(object_program);
    set_uniforms(picture.program());
    for (const GlProgram* program : stage.programs()) set_uniforms(*program);
    stage.bake(clip, kLitUnit, kDarkUnit, kOpenUnit);
}

void Renderer::Implementation::set_uniforms(const GlProgram& program) const {
    const Room& room = scene.room;
    const KeyLight& key = scene.key_light;
    const auto width = static_cast<float>(scene.width), height = static_cast<float>(scene.height);
    const Eigen::Vector3f key_light = 1.6f * key.strength * key.color;
    program.use();
    program.set("picture", Eigen::Vector3f(width, height, 4 / (width * width + height * height)));
    program.set("clip_from_world", clip);
    program.set("shadow_from_world", on_map);
    program.set("shadow_map", static_cast<int>(kShadowUnit));
    program.set("shadow_texel", scene.shadow_size > 0 ? 1 / static_cast<float>(scene.shadow_size) : 0.0f);
    program.set("shadow_offset", kShadowShift * texel);
    program.set("matrices", static_cast<int>(kMatrixUnit));
    program.set("modes", static_cast<int>(kModesUnit));
    program.set("normals", static_cast<int>(kNormalsUnit));
    program.set("surfaces", static_cast<int>(kSurfacesUnit));
    program.set("depths", static_cast<int>(kDepthsUnit));
    program.set("parts", static_cast<int>(kPartsUnit));
    program.set("lit_floor", static_cast<int>(kLitUnit));
    program.set("dark_floor", static_cast<int>(kDarkUnit));
    program.set("open_floor", static_cast<int>(kOpenUnit));
    program.set("floor_color", room.floor_color);
    program.set("wall_color", room.wall_color);
    program.set("floor_height", room.floor_height);
    program.set("eye", camera.eye);
    program.set("towards_light", Eigen::Vector3f(key.towards_light.normalized()));
    program.set("key_light", key_light);
    program.set("sky_light", Eigen::Vector3f(0.13f, 0.13f, 0.15f));
    program.set("ground_light", Eigen::Vector3f(0.03f * Eigen::Vector3f::Ones() +
                                                0.10f * room.floor_color.cwiseProduct(key_light)));
    program.set("fill_light", Eigen::Vector3f(0.07f, 0.085f, 0.13f));
}

void Renderer::Implementation::draw_shadow() {
    shadow.begin();
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.Enable(GL_DEPTH_CLAMP);  // what is nearer to the light than the map's depth still casts
    for (const PixelBox& box : changes.shadow()) {
        shadow.begin(box);
        shadow_program.use();
        geometry.draw(kMatrixUnit, kModesUnit, [&](std::size_t object) {
            return std::vector<PixelBox>(changes.shadow_box(object).meets(box) ? 1 : 0, box);
        });
    }
    gl.Disable(GL_DEPTH_CLAMP);
    gl.Disable(GL_POLYGON_OFFSET_FILL);
    gl.Disable(GL_SCISSOR_TEST);
    gl.Disable(GL_DEPTH_TEST);
}

void Renderer::Implementation::draw_objects() {
    gl.Enable(GL_DEPTH_TEST);
    picture.begin_objects(changes.objects());
    object_program.use();
    gl.Enable(GL_SCISSOR_TEST);
    gl.Enable(
        GL_CLIP_DISTANCE0);  // the floor, which is laid under the objects afterwards, hides what is below it
    geometry.draw(kMatrixUnit, kModesUnit, [this](std::size_t object) { return changes.boxes(object); });
    gl.Disable(GL_CLIP_DISTANCE0);
    gl.Disable(GL_SCISSOR_TEST);
    gl.Disable(GL_DEPTH_TEST);
}

/// An object that comes to a tile or leaves it has moved, and the tile is drawn again: so a tile that is kept
/// would be drawn by the same shader now.
void Renderer::Implementation::draw_picture(const TileMask& tiles) {
    TileMask objects = tiles, background = tiles;
    objects.keep(changes.occupied(), true);
    background.keep(changes.occupied(), false);
    if (!background.empty()) stage.draw_background(picture.begin_picture(background));
    if (!objects.empty()) stage.draw(picture.begin_picture(objects));
}

/// Draws the shadow map and the objects' surfaces, which do not ask what has changed in the map.
void Renderer::Implementation::begin(const FrameState& frame) {
    context.make_current();
    const Camera& from = frame.camera ? *frame.camera : scene.camera;
    if (!looks_somewhere(from)) throw std::invalid_argument(std::string("Renderer::draw: ") + kBadCamera);
    geometry.update(frame, from.eye);
    if (from != camera) look_from(from);
    changes.update(frame);
    if (!changes.all()) shadow.keep();
    if (!changes.shadow().empty()) draw_shadow();
    if (!changes.objects().empty()) draw_objects();
}

/// Puts what begin() has drawn in its light: first the tiles where surfaces have been drawn again, and while
/// the rasteriser does so, what else the shadow map's changes ask for is found.
void Renderer::Implementation::shade() {
    const float least = kLeastBall * (scene.camera.target - scene.camera.eye).norm();
    const bool floor_changed = stage.darken(geometry.volume_balls(shaders::kMaxBalls, least));
    shadow.read(changes.all() ? std::vector<PixelBox>() : changes.shadow());
    draw_picture(changes.objects());
    gl.Flush();
    changes.take(shadow.changed());
    if (changes.all()) shadow.forget();
    TileMask rest = changes.picture();
    if (floor_changed) rest.fill();
    shaded = rest.bounds();
    rest.keep(changes.objects(), false);
    draw_picture(rest);
    gl.Flush();
}

DrawTimes Renderer::Implementation::draw(const FrameState& frame, Image& image) {
    finish(image);  // of frames drawn before
    begin(frame);
    shade();
    DrawTimes times;
    gl.Finish();
    times.drawn = std::chrono::steady_clock::now();
    finish(image);
    times.read = std::chrono::steady_clock::now();
    return times;
}

/// The processor works on the new frame's vertices while the rasteriser shades the one before, and converts
/// that one's pixels while it shades the new one.
bool Renderer::Implementation::draw_next(const FrameState& frame, Image& before) {
    begin(frame);
    const bool is_one_before = shaded.has_value();
    if (shaded) picture.read(*shaded);
    shade();
    if (is_one_before) picture.give(before);
    return is_one_before;
}

bool Renderer::Implementation::finish(Image& image) {
    if (!shaded) return false;
    context.make_current();
    picture.read(*shaded);
    shaded.reset();
    picture.give(image);
    return true;
}

Renderer::Renderer(const SceneDescription& scene)
    : implementation_(std::make_unique<Implementation>(scene)) {}

Renderer::~Renderer() = default;

DrawTimes Renderer::draw(const FrameState& frame, Image& image) {
    return implementation_->draw(frame, image);
}

bool Renderer::draw_next(const FrameState& frame, Image& before) {
    return implementation_->draw_next(frame, before);
}

bool Renderer::finish(Image& image) {
    return implementation_->finish(image);
}

void Renderer::forget() {
    implementation_->changes.forget();
}

std::string Renderer::version() const {
    implementation_->context.make_current();
    const auto text = [this](GLenum name) {
        return std::string(reinterpret_cast<const char*>(implementation_->gl.GetString(name)));
    };
    return implementation_->context.name() + std::string(", OpenGL ") + text(GL_VERSION) + ", " +
           text(GL_RENDERER);
}

std::size_t Renderer::triangles() const {
    return implementation_->geometry.triangles();
}

}  // namespace render
