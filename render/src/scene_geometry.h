#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "changes.h"
#include "gl_functions.h"
#include "mode_texture.h"
#include "render/mesh.h"
#include "render/scene.h"

namespace render {

/// All objects of a scene in one vertex buffer (each object's copy of its mesh carries its number and its parts'),
/// the parts' looks in another and, a frame, one small buffer of matrices that the vertex shader reads by that number: a draw
/// changes no state. Ends with its context.
class SceneGeometry {
public:
    /// Loads the meshes, each file once. Throws std::runtime_error as load_mesh does, or for a solid that is
    /// out of range. `widening_m`: of the shadows that are widened.
    SceneGeometry(const GlFunctions& gl, const SceneDescription& scene, float widening_m);

    /// Takes the frame's matrices, drops hidden objects and sorts the rest by distance from the eye, nearest
    /// first. Throws std::invalid_argument for a frame that does not fit the scene or a
    /// visible object's matrix that is not finite.
    void update(const FrameState& frame, const Eigen::Vector3f& eye);
    /// The parts' looks, by the numbers that surfaces have, to the texture unit: colour and metallic, then roughness and lathed.
    void bind_parts(GLuint unit) const;

    /// Where an object, by its number, is drawn.
    using BoxesOf = std::function<std::vector<PixelBox>(std::size_t)>;
    /// Draws what update() kept, each object cut to its boxes, with the program in use; the matrices and the
    /// shapes of modes are bound to the given texture units.
    void draw(GLuint matrix_unit, GLuint mode_unit, const BoxesOf& boxes_of) const;
    /// Of all objects, in order.
    [[nodiscard]] std::vector<ObjectBounds> bounds() const;
    [[nodiscard]] bool bends() const { return !modes_.empty(); }

    /// (centre, radius) of balls with the volumes of the visible objects where these stand, largest first, at
    /// most `limit`, none of a radius below `least` [m].
    [[nodiscard]] std::vector<Eigen::Vector4f> volume_balls(std::size_t limit, float least) const;
    [[nodiscard]] std::size_t triangles() const;

    // Vertex attributes, as the shaders number them.
    static constexpr GLuint kPosition = 0, kNormal = 1, kPartObject = 2, kFirstModeTexel = 3;

private:
    struct Object {
        GLsizei first_index, index_count;
        ObjectBounds bounds;  ///< of its mesh
        float volume;         ///< of the mesh, object frame
        int modes;
        std::optional<Eigen::Matrix4f> stands;  ///< see SceneObject
    };
    struct Drawn {
        std::size_t object;
        float distance;
        bool mirrored;
        Eigen::Matrix4f world_from_object;
    };

    void make_buffers(const SceneDescription& scene, const std::vector<const Mesh*>& meshes);
    void add_modal(const FrameState& frame, std::size_t object);

    const GlFunctions& gl_;
    float widening_m_;
    std::vector<Object> objects_;
    std::vector<Drawn> drawn_;
    std::vector<Eigen::Vector4f>
        matrix_rows_;  ///< six an object: three of world_from_object, three of the normals' matrix (their
    ///< last places: where its modal coordinates begin, how many there are, its shadow's widening [m]); then the modal coordinates
    ModeTexture modes_;
    GLuint vertex_array_ = 0, matrix_buffer_ = 0, matrix_texture_ = 0, part_buffer_ = 0, part_texture_ = 0;
};

}  // namespace render
