#include "shaders.h"

namespace render::shaders {
namespace {

const char* const kVersion = "#version 330 core\n";

/// World position of a vertex from the matrices' buffer: six texels an object.
const char* const kObjectMatrices = R"(
uniform samplerBuffer matrices;
vec3 to_world(vec3 position, int object) {
    vec4 x = texelFetch(matrices, object), y = texelFetch(matrices, object + 1);
    vec4 z = texelFetch(matrices, object + 2);
    return vec3(dot(x.xyz, position) + x.w, dot(y.xyz, position) + y.w, dot(z.xyz, position) + z.w);
}
vec3 rotate(vec3 direction, int rows) {
    vec4 x = texelFetch(matrices, rows), y = texelFetch(matrices, rows + 1);
    vec4 z = texelFetch(matrices, rows + 2);
    return vec3(dot(x.xyz, direction), dot(y.xyz, direction), dot(z.xyz, direction));
}
)";

/// Bends position, normal and groove (along the lathe) in the object's frame. The places of the normals' rows
/// that rotate() leaves out tell where the object's modal coordinates begin and how many there are; a vertex
/// has two tangents t1 x t2 = normal in the texture of modes, then, a mode, the displacement and the two
/// tangents' changes.
const char* const kBend = R"(
layout(location = 3) in int first_mode_texel;
uniform samplerBuffer modes;
void bend(inout vec3 position, inout vec3 normal, inout vec3 groove, int object) {
    int first = int(texelFetch(matrices, object + 3).w), count = int(texelFetch(matrices, object + 4).w);
    if (count == 0) return;
    vec3 t1 = texelFetch(modes, first_mode_texel).xyz, t2 = texelFetch(modes, first_mode_texel + 1).xyz;
    vec2 along = vec2(dot(groove, t1), dot(groove, t2));
    for (int k = 0; k < count; ++k) {
        float q = texelFetch(matrices, first + k / 4)[k % 4];
        int at = first_mode_texel + 2 + 3 * k;
        position += q * texelFetch(modes, at).xyz;
        t1 += q * texelFetch(modes, at + 1).xyz;
        t2 += q * texelFetch(modes, at + 2).xyz;
    }
    normal = cross(t1, t2);
    groove = along.x * t1 + along.y * t2;
}
)";

/// From linear light to the 8-bit picture: vignette, filmic curve (Narkowicz's fit of ACES), sRGB transfer
/// (roots fit, error below 0.002).
const char* const kPicture = R"(
uniform vec3 picture;  // width, height, 1 / half diagonal squared [pixels]
out vec4 fragment;
float vignette() {
    vec2 from_center = gl_FragCoord.xy - 0.5 * picture.xy;
    return 1.0 - 0.42 * dot(from_center, from_center) * picture.z;
}
vec3 display(vec3 light) {
    vec3 x = light * vignette();
    x = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
    vec3 s1 = sqrt(x), s2 = sqrt(s1), s3 = sqrt(s2);
    return 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.022541147 * x;
}
)";

/// A normal as two numbers in [0, 1], to 16 bits, and two directions across it (Duff et al. 2017, "Building an
/// orthonormal basis, revisited").
const char* const kNormals = R"(
const float kMostParts = 65535.0;
vec2 folded_normal(vec3 n) {
    vec2 flat_xy = n.xy / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-12);
    vec2 signs = vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    if (n.z < 0.0) flat_xy = (1.0 - abs(flat_xy.yx)) * signs;
    return floor(65535.0 * (0.5 + 0.5 * flat_xy) + 0.5) / 65535.0;
}
vec3 unfolded_normal(vec2 folded) {
    vec2 flat_xy = 2.0 * folded - 1.0;
    float z = 1.0 - abs(flat_xy.x) - abs(flat_xy.y), below = max(-z, 0.0);
    vec2 towards = vec2(flat_xy.x < 0.0 ? below : -below, flat_xy.y < 0.0 ? below : -below);
    return normalize(vec3(flat_xy + towards, z));
}
void across(vec3 n, out vec3 t1, out vec3 t2) {
    float s = n.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + n.z), b = n.x * n.y * a;
    t1 = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    t2 = vec3(b, s + n.y * n.y * a, -n.y);
}
)";

/// The wall: a gradient with a soft glow behind the kit.
const char* const kBackdrop = R"(
uniform vec3 wall_color;
vec3 backdrop() {
    vec2 at = gl_FragCoord.xy / picture.xy - vec2(0.5, 0.72);
    float glow = 1.0 / (1.0 + 5.0 * dot(at, at));
    return wall_color * (0.22 + 1.1 * glow * glow);
}
)";

/// The spot's soft edge: a factor from the place in the shadow map.
const char* const kSpot = R"(
float spot(vec3 at) {
    vec2 from_center = 2.0 * at.xy - 1.0;
    float outside = dot(from_center, from_center);
    return 1.0 / (1.0 + 1.1 * outside + 1.6 * outside * outside);
}
)";

/// Part of the key light that the shadow map lets through: the mean of comparisons of 2x2 texels at four
/// places around; 1 outside the map. Look-ups are the dearest part of the fragment shaders.
const char* const kShadow = R"(
uniform sampler2DShadow shadow_map;
uniform float shadow_texel;  // 1 / size
float shadow_look_up(vec3 at, vec2 texels) {
    return textureLod(shadow_map, vec3(at.xy + shadow_texel * texels, at.z), 0.0);
}
float within_map(vec3 at, float lit) {
    vec2 from_center = abs(at.xy - 0.5);
    return mix(1.0, lit, step(max(from_center.x, from_center.y), 0.495));
}
float shadow_light(vec3 at) {
    return within_map(at, 0.25 * (shadow_look_up(at, vec2(0.5, 1.0)) + shadow_look_up(at, vec2(-1.0, 0.5)) +
                                  shadow_look_up(at, vec2(-0.5, -1.0)) + shadow_look_up(at, vec2(1.0, -0.5))));
}
)";

}  // namespace

/// The last place of a normals' matrix, which rotate() leaves out too, holds by how much an object's shadow is widened [m].
std::string shadow_vertex(bool bending) {
    return std::string(kVersion) + R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 rest_normal;
layout(location = 2) in vec2 part_object;
uniform mat4 clip_from_light_world;
)" + kObjectMatrices +
           (bending ? std::string(kBend) + R"(
void deform(inout vec3 at, inout vec3 normal, int object) {
    vec3 groove = vec3(0.0);
    bend(at, normal, groove, object);
}
)"
                    : "void deform(inout vec3 at, inout vec3 normal, int object) {}\n") +
           R"(
void main() {
    int object = 6 * int(part_object.y);
    vec3 at = position, normal = rest_normal;
    deform(at, normal, object);
    vec3 world = to_world(at, object);
    float widening = texelFetch(matrices, object + 5).w;
    if (widening > 0.0) world += widening * normalize(rotate(normal, object + 3));
    gl_Position = clip_from_light_world * vec4(world, 1.0);
}
)";
}

std::string shadow_fragment() {
    return std::string(kVersion) + "void main() {}\n";
}

std::string object_vertex(bool bending) {
    const std::string bend_it = std::string(kBend) + R"(
void deform(out vec3 position, out vec3 normal, out vec3 groove, int object) {
    position = rest_position;
    normal = rest_normal;
    groove = vec3(-position.z, 0.0, position.x);
    bend(position, normal, groove, object);
}
)";
    const std::string keep_it = R"(
void deform(out vec3 position, out vec3 normal, out vec3 groove, int object) {
    position = rest_position;
    normal = rest_normal;
    groove = vec3(-position.z, 0.0, position.x);
}
)";
    return std::string(kVersion) + R"(
layout(location = 0) in vec3 rest_position;
layout(location = 1) in vec3 rest_normal;
layout(location = 2) in vec2 part_object;
uniform mat4 clip_from_world;
uniform float floor_height;  // nothing below is seen
out vec3 v_normal, v_groove;
flat out float v_part;
)" + kObjectMatrices +
           (bending ? bend_it : keep_it) + R"(
void main() {
    int object = 6 * int(part_object.y);
    vec3 position, normal, groove;
    deform(position, normal, groove, object);
    vec3 world = to_world(position, object);
    v_normal = normalize(rotate(normal, object + 3));
    v_groove = rotate(groove, object);
    v_part = part_object.x;
    gl_Position = clip_from_world * vec4(world, 1.0);
    gl_ClipDistance[0] = world.y - floor_height;
}
)";
}

/// What of a surface does not follow from its depth: the normal, folded onto the plane as an octahedron (Meyer et
/// al. 2010, "On floating-point normal vectors"), the direction of the grooves in the plane across it, of which only
/// the line counts, and the part's number.
std::string object_fragment() {
    return std::string(kVersion) + kNormals + R"(
in vec3 v_normal, v_groove;
flat in float v_part;
layout(location = 0) out vec2 folded;
layout(location = 1) out vec2 groove_part;
void main() {
    folded = folded_normal(v_normal);
    vec3 t1, t2;
    across(unfolded_normal(folded), t1, t2);
    vec2 groove = vec2(dot(v_groove, t1), dot(v_groove, t2));
    groove *= groove.y < 0.0 ? -1.0 : 1.0;
    float along = groove.x / max(abs(groove.x) + groove.y, 1e-12);
    groove_part = vec2(0.5 + 0.5 * along, v_part / kMostParts);
}
)";
}

/// Where a point of the floor lies in the picture and in the shadow map, and how much of the sky the balls
/// above leave open to it.
std::string floor_vertex() {
    return std::string(kVersion) + R"(
layout(location = 0) in vec3 position;  // world
uniform mat4 clip_from_world, shadow_from_world;
uniform vec4 balls[)" +
           std::to_string(kMaxBalls) + R"(];  // centre and radius of what stands above the floor
uniform int ball_count;
out vec3 v_world, v_shadow;
out float v_open;  // root of the part of the sky that the floor sees: darkening in display values
void main() {
    v_world = position;
    v_shadow = (shadow_from_world * vec4(position, 1.0)).xyz;
    float covered = 0.0;
    for (int i = 0; i < ball_count; ++i) {
        vec3 to_ball = balls[i].xyz - position;
        float distance2 = dot(to_ball, to_ball) + balls[i].w * balls[i].w * 0.25;
        covered += max(to_ball.y, 0.0) * inversesqrt(distance2) * balls[i].w * balls[i].w / distance2;
    }
    v_open = inversesqrt(1.0 + 2.2 * covered);
    gl_Position = clip_from_world * vec4(position, 1.0);
}
)";
}

/// The floor in the key light (key_part 1) or in its shadow (0), for baking: planks with seams, a gloss,
/// fading into the wall with distance.
std::string floor_bake_fragment() {
    return std::string(kVersion) + R"(
in vec3 v_world, v_shadow;
uniform vec3 eye, towards_light, key_light, sky_light, floor_color, center;
uniform float key_part;
)" + kPicture +
           kBackdrop + kSpot + R"(
float random(vec2 cell) { return fract(sin(dot(cell, vec2(12.9898, 78.233))) * 43758.547); }
void main() {
    vec2 plank = vec2(v_world.x / 0.14, v_world.z / 1.7);
    float row = floor(plank.x);
    plank.y += 0.37 * row;
    float tone = random(vec2(row, floor(plank.y)));
    vec2 from_edge = 0.5 - abs(fract(plank) - 0.5);
    float distance_eye = length(eye - v_world);
    float seam = smoothstep(0.0, 0.012 + 0.012 * distance_eye, from_edge.x) *
                 smoothstep(0.0, 0.004 + 0.002 * distance_eye, from_edge.y);
    vec3 color = floor_color * (0.82 + 0.3 * tone) * (0.6 + 0.4 * seam);
    vec3 v = (eye - v_world) / distance_eye, h = normalize(v + towards_light);
    vec3 key = key_light * (key_part * spot(v_shadow));
    float gloss = pow(max(h.y, 0.0), 40.0) * 0.07 * (0.6 + 0.4 * tone) * seam;
    vec3 light = color * (key * towards_light.y + sky_light) + key * gloss;
    float far = smoothstep(1.2, 5.5, length(v_world.xz - center.xz));
    fragment = vec4(display(mix(light, backdrop(), far)), 1.0);
}
)";
}

std::string backdrop_vertex() {
    return std::string(kVersion) + R"(
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
}
)";
}

std::string backdrop_bake_fragment() {
    return std::string(kVersion) + kPicture + kBackdrop + R"(
void main() { fragment = vec4(display(backdrop()), 1.0); }
)";
}

/// How open the sky is to a point of the floor.
std::string floor_open_fragment() {
    return std::string(kVersion) + R"(
in float v_open;
out vec4 fragment;
void main() { fragment = vec4(v_open); }
)";
}

std::string tile_vertex() {
    return std::string(kVersion) + R"(
layout(location = 0) in vec2 corner;  // [pixels]
uniform vec3 picture;
uniform float depth;
void main() { gl_Position = vec4(2.0 * corner / picture.xy - 1.0, 2.0 * depth - 1.0, 1.0); }
)";
}

std::string tile_fragment() {
    return std::string(kVersion) + R"(
layout(location = 0) out vec2 folded;
layout(location = 1) out vec2 groove_part;
void main() { folded = groove_part = vec2(0.0); }
)";
}

namespace {

/// The light that a place of an object sends to the eye, of the key light that comes there and of the surroundings.
/// Key light: GGX with roughness across the grooves raised for lathed metal (Burley 2012), visibility and
/// Fresnel by the fit of Karis and Lagarde for one light. Surroundings: hemisphere for diffuse; for
/// reflections a warm stage floor, a dark room, and two soft boxes.
std::string surface_light(bool coarse) {
    // A coarse mesh's normals may point away from the eye at its outline: there they are turned until they do
    // not, as the room's lights would else be mirrored in what is seen from behind.
    const std::string turn = coarse ? "    n = normalize(n - v * min(dot(n, v), 0.0));\n" : "";
    return R"(
uniform samplerBuffer parts;  // two texels each
uniform vec3 towards_light, sky_light, ground_light, fill_light;
vec3 surroundings(vec3 r, float roughness) {
    float blur = 0.08 + 0.8 * roughness;
    vec3 light = mix(ground_light, sky_light, smoothstep(-blur, blur, r.y));
    float over = dot(r, vec3(-0.42, 0.74, -0.53)), side = dot(r, vec3(0.82, 0.36, 0.45));
    float warm = smoothstep(0.86 - 0.5 * blur, 0.90 + 0.3 * blur, over);
    float cool = smoothstep(0.88 - 0.5 * blur, 0.93 + 0.3 * blur, side);
    return light + (vec3(1.9, 1.75, 1.5) * warm + vec3(0.55, 0.7, 1.0) * cool) * (1.0 - 0.75 * roughness);
}
vec3 surface_light(vec3 world, vec3 normal, vec2 groove_part, vec3 key_here) {
    vec3 t1, t2;
    across(normal, t1, t2);
    float x = 2.0 * groove_part.x - 1.0;
    vec3 groove = normalize(x * t1 + (1.0 - abs(x)) * t2);
    int part = 2 * int(kMostParts * groove_part.y + 0.5) - 2;
    vec4 color_metallic = texelFetch(parts, part), finish = texelFetch(parts, part + 1);
    vec3 color = color_metallic.rgb, n = normal, v = normalize(eye - world);
)" + turn + R"(
    vec3 h = normalize(v + towards_light);
    float metallic = color_metallic.a, roughness = finish.x, lathed = finish.y;
    float nl = max(dot(n, towards_light), 0.0), nv = clamp(dot(n, v), 0.0, 1.0);
    float nh = max(dot(n, h), 0.0), lh = dot(towards_light, h);
    vec3 f0 = mix(vec3(0.04), color, metallic), diffuse = color * (1.0 - metallic);

    float along = max(roughness * roughness, 0.004);
    float across_grooves = mix(along, min(1.0, 2.5 * along + 0.25), lathed);
    float th = dot(groove, h), bh2 = max(1.0 - nh * nh - th * th, 0.0);
    float d = th * th / (along * along) + bh2 / (across_grooves * across_grooves) + nh * nh;
    float bound = along * across_grooves * d * d * max(lh * lh, 0.1) * (4.0 * roughness + 2.0);
    float highlight = min(1.0 / bound, 30.0);
    vec3 key = key_here * nl;

    float towards_fill = 0.5 + 0.5 * dot(normal, vec3(0.62, 0.25, 0.74));
    vec3 around = mix(ground_light, sky_light, 0.5 + 0.5 * normal.y) + fill_light * (towards_fill * towards_fill);
    vec3 grooved = normalize(mix(n, v - groove * dot(groove, v), 0.45 * lathed));
    float grazing = 1.0 - nv, grazing2 = grazing * grazing;
    vec3 f = f0 + (max(vec3(1.0 - roughness), f0) - f0) * (grazing2 * grazing2 * grazing);
    vec3 mirrored = f * surroundings(reflect(-v, grooved), roughness);
    return diffuse * (around + key) + f0 * key * highlight + mirrored;
}
)";
}

}  // namespace

namespace {

/// The baked floor, which the shadow map and the sky's openness darken. Above the floor's edge both bakes are the wall
/// and the sky is open.
const char* const kBackground = R"(
uniform sampler2D lit_floor, dark_floor, open_floor;
uniform mat4 shadow_from_world;
uniform vec3 eye, ray, ray_x, ray_y;  // through the place (x, y): ray + x ray_x + y ray_y, of depth 1
uniform float floor_height;
vec3 through(vec2 at) { return ray + at.x * ray_x + at.y * ray_y; }
// 0: above the horizon.
float distance_of_floor(vec3 along) { return clamp((floor_height - eye.y) / along.y, 0.0, 1e4); }
vec3 background(ivec2 at, float distance, float key) {
    float open = texelFetch(open_floor, at, 0).r;
    vec3 lit = texelFetch(lit_floor, at, 0).rgb * (0.7 + 0.3 * open);
    vec3 dark = texelFetch(dark_floor, at, 0).rgb * open;
    return mix(dark, lit, distance > 0.0 ? key : 1.0);  // the wall has no shadows
}
)";

}  // namespace

std::string background_fragment() {
    return std::string(kVersion) + kBackground + kShadow + R"(
out vec4 fragment;
void main() {
    vec3 along = through(gl_FragCoord.xy);
    float distance = distance_of_floor(along);
    float key = shadow_light((shadow_from_world * vec4(eye + distance * along, 1.0)).xyz);
    fragment = vec4(background(ivec2(gl_FragCoord.xy), distance, key), 1.0);
}
)";
}

/// The objects' surfaces in their light, over the background.
/// Of a pixel's samples those that show one surface are shaded once, at the first one's place; what no object
/// covers is the floor, last. The rasteriser runs all lanes of a block as often as one needs, and a loop that tests at its
/// head once more.
std::string picture_fragment(bool multisampling, bool coarse) {
    static_assert(kSamples == 4);
    const std::string samples = multisampling ? R"(
uniform sampler2DMS normals, surfaces, depths;
uniform vec4 sample_xy[2];
const int kSamples = 4;
vec2 place_of_sample(int i) {
    vec4 pair = i < 2 ? sample_xy[0] : sample_xy[1];
    return (i & 1) == 0 ? pair.xy : pair.zw;
}
)"
                                              : R"(
uniform sampler2D normals, surfaces, depths;
const int kSamples = 1;
vec2 place_of_sample(int i) { return vec2(0.5); }
)";
    // Of all samples: vec2 `name`0 to `name`3.
    const auto fetch = [&](const std::string& name, const std::string& texture) {
        std::string text;
        for (int i = 0; i < kSamples; ++i)
            text += "    vec2 " + name + std::to_string(i) + " = texelFetch(" + texture + ", at, " +
                    std::to_string(multisampling ? i : 0) + ").rg;\n";
        return text;
    };
    const std::string all_parts =
        multisampling ? "vec4(s0.y, s1.y, s2.y, s3.y)" : "vec4(s0.y, 0.0, 0.0, 0.0)";
    return std::string(kVersion) + R"(
uniform vec2 depth_from_window;
uniform float shadow_offset;  // along the normal [m]
uniform vec3 key_light;
)" + kPicture +
           kSpot + kShadow + kBackground + kNormals + surface_light(coarse) + samples + R"(
int same(float part, float other, vec2 normal, vec2 normal_of_other) {
    vec2 apart = abs(normal - normal_of_other);
    return part == other && max(apart.x, apart.y) < 0.05 ? 1 : 0;
}
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
)" + fetch("s", "surfaces") +
           "    ivec4 left = ivec4(greaterThan(" + all_parts + ", vec4(0.0)));" + R"(
    vec3 sum = vec3(0.0);
    int still = kSamples;
    do {
)" + fetch("n", "normals") +
           R"(
        int i = left.x != 0 ? 0 : left.y != 0 ? 1 : left.z != 0 ? 2 : 3;
        vec2 s = i == 0 ? s0 : i == 1 ? s1 : i == 2 ? s2 : s3;
        vec2 n = i == 0 ? n0 : i == 1 ? n1 : i == 2 ? n2 : n3;
        ivec4 shown = left * ivec4(same(s0.y, s.y, n0, n), same(s1.y, s.y, n1, n), same(s2.y, s.y, n2, n),
                                   same(s3.y, s.y, n3, n));
        int count = shown.x + shown.y + shown.z + shown.w;
        bool of_object = count > 0;
        vec3 along = through(of_object ? vec2(at) + place_of_sample(i) : gl_FragCoord.xy);
        float depth = depth_from_window.y / (2.0 * texelFetch(depths, at, i).r - depth_from_window.x);
        float distance = distance_of_floor(along);
        vec3 world = eye + (of_object ? depth : distance) * along, normal = unfolded_normal(n);
        vec3 on_map = (shadow_from_world * vec4(world, 1.0)).xyz;
        vec3 off_surface = on_map + mat3(shadow_from_world) * (shadow_offset * normal);
        float key = shadow_light(of_object ? off_surface : on_map);
        vec3 light = surface_light(world, normal, s, key * spot(on_map) * key_light);
        count = of_object ? count : still;
        sum += float(count) * (of_object ? display(light) : background(at, distance, key));
        left -= shown;
        still -= count;
    } while (still > 0);
    fragment = vec4(sum / float(kSamples), 1.0);
}
)";
}

}  // namespace render::shaders
