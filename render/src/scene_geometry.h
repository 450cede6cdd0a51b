#pragma once
#include <vector>

#include "gl_functions.h"
#include "mode_texture.h"
#include "render/mesh.h"
#include "render/scene.h"

namespace render {

/// All objects of a scene in one vertex buffer (each object's copy of its mesh carries its colours and its
/// number) and, a frame, one small buffer of matrices that the vertex shader reads by that number: a draw
/// changes no state. Ends with its context.
class SceneGeometry {
public:
    /// Loads the meshes, each file once. Throws std::runtime_error as load_mesh does, or for a solid that is
    /// out of range.
    SceneGeometry(const GlFunctions& gl, const SceneDescription& scene);

    /// Takes the frame's matrices, drops hidden objects and sorts the rest by distance from the eye, nearest
    /// first. Throws std::invalid_argument for a frame that does not fit the scene or a visible object's
    /// matrix that is not finite.
    void update(const FrameState& frame, const Eigen::Vector3f& eye);

    /// Draws what update() kept, with the program in use; the matrices and the shapes of modes are bound to
    /// the given texture units.
    void draw(GLuint matrix_unit, GLuint mode_unit) const;
    [[nodiscard]] bool bends() const { return !modes_.empty(); }

    /// (centre, radius) of balls with the volumes of the visible objects, largest first, at most `limit`.
    [[nodiscard]] std::vector<Eigen::Vector4f> volume_balls(std::size_t limit) const;
    [[nodiscard]] std::size_t triangles() const;

    // Vertex attributes, as the shaders number them.
    static constexpr GLuint kPosition = 0, kNormal = 1, kColorMetallic = 2, kRoughnessLathedObject = 3,
                            kFirstModeTexel = 4;

private:
    struct Object {
        GLsizei first_index, index_count;
        Eigen::Vector3f center;  ///< of the mesh's bounds, object frame
        float volume;            ///< of the mesh, object frame
        int modes;
    };
    struct Drawn {
        std::size_t object;
        float distance;
        bool mirrored;
        Eigen::Vector4f ball;
    };

    void make_buffers(const std::vector<SceneObject>& objects, const std::vector<const Mesh*>& meshes);
    void add_modal(const FrameState& frame, std::size_t object);

    const GlFunctions& gl_;
    std::vector<Object> objects_;
    std::vector<Drawn> drawn_;
    std::vector<Eigen::Vector4f>
        matrix_rows_;  ///< six an object: three of world_from_object, three of the normals' matrix (their
                       ///< last places: where its modal coordinates begin, how many there are); then the
                       ///< modal coordinates
    ModeTexture modes_;
    GLuint vertex_array_ = 0, matrix_buffer_ = 0, matrix_texture_ = 0;
};

}  // namespace render
