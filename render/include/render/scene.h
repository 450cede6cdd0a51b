#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/mesh.h"

namespace render {

/// How a surface looks. Colour is linear RGB in [0, 1].
struct Appearance {
    Eigen::Vector3f color = Eigen::Vector3f(0.7f, 0.7f, 0.7f);
    float metallic = 0;      ///< 0 dielectric (skin, lacquer, wood), 1 metal (bronze)
    float roughness = 0.5f;  ///< 0 mirror, 1 chalk
    float lathed =
        0;  ///< 0 to 1: fine grooves around the object's y axis, as on cymbals: highlights become spokes
};

/// A part of a mesh file names its material; `parts` gives the look of each name ("shell", "head", "hoop",
/// ...); others use `body`.
struct Look {
    Appearance body;
    std::vector<std::pair<std::string, Appearance>> parts;
};

/// How a mesh bends: with coordinates q a vertex at r moves to r + sum q_k u_k(r), its normal n to the
/// normalised cof(I + sum q_k du_k/dr) n. Vertices are counted through the mesh's parts.
struct ModeShapes {
    int count = 0;
    std::vector<Eigen::Vector3f> displacement;  ///< u_k at a vertex: [vertex * count + k], object frame
    std::vector<Eigen::Matrix3f> gradient;      ///< (i, j) = du_i / dr_j there
};

/// A mesh given by values, rigid (count 0) or bending; many objects may use one.
struct Solid {
    Mesh mesh;
    ModeShapes modes;
};

/// What an object does to the key light.
enum class Shadow : std::uint8_t {
    cast,
    /// Casts a shadow widened by what the shadow map's filter blurs (1.25 texels), for rods: where they are thinner than
    /// that, their shadow would be pale and broken.
    widened,
    none,  ///< lets it through; the others' shadows lie on it
};

/// One drawn object: a mesh, drawn with one 4x4 matrix per frame.
struct SceneObject {
    std::string name;
    std::filesystem::path mesh;  ///< OBJ, GLB or glTF, STL
    Look look;
    int solid = -1;  ///< of the scene's solids, instead of a file
    /// Where an object stands that stays in its place: world_from_object at rest. The floor under it is
    /// darkened from there, whatever its motion; else from where it is in the frame.
    std::optional<Eigen::Matrix4f> stands = std::nullopt;
    Shadow shadow = Shadow::cast;
};

struct Camera {
    Eigen::Vector3f eye = Eigen::Vector3f(0, 1.5f, 1.55f);  ///< [m], world
    Eigen::Vector3f target = Eigen::Vector3f(0, 0.68f, -0.25f);
    float vertical_fov_deg = 42;
    /// Of any length: up in the picture as far as it is across the view. Along the view -z takes its place.
    Eigen::Vector3f up = Eigen::Vector3f::UnitY();

    bool operator==(const Camera&) const = default;
};

struct Room {
    Eigen::Vector3f floor_color = Eigen::Vector3f(0.20f, 0.115f, 0.06f);
    Eigen::Vector3f wall_color = Eigen::Vector3f(0.075f, 0.07f, 0.09f);
    float floor_height = 0;  ///< world y [m]
};

/// Parallel light with a shadow, its strength falling off softly around the camera's target like a spot's.
/// The shadow covers what the camera sees at the target's distance.
struct KeyLight {
    Eigen::Vector3f towards_light = Eigen::Vector3f(-0.55f, 1.0f, 0.45f);  ///< world, any length but 0
    Eigen::Vector3f color = Eigen::Vector3f(1.0f, 0.86f, 0.68f);
    float strength = 1;  ///< 0: fill light only
};

struct SceneDescription {
    std::vector<SceneObject> objects;
    std::vector<Solid> solids = {};
    Camera camera;
    Room room;
    KeyLight key_light;
    int width = 640, height = 480;
    int samples = 4;         ///< 0 or 1: no antialiasing; else 4 a pixel
    int shadow_size = 1024;  ///< texels per side, 0: no shadow
};

/// One frame: per object, in the order of the description, a matrix (w row 0 0 0 1; scale and shear allowed)
/// and whether it is drawn.
struct FrameState {
    std::vector<Eigen::Matrix4f> world_from_object;
    std::vector<bool> visible;
    /// Coordinates of each object's modes (as many as its solid has); may be empty when no object bends. The
    /// matrix comes after them.
    std::vector<Eigen::VectorXf> modal = {};
    /// Where it is seen from; none: from the scene's camera. The light stands by the scene's.
    std::optional<Camera> camera = std::nullopt;
};

/// Top row first, RGB, 8 bits, sRGB.
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

}  // namespace render
