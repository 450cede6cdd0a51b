#include "scene_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <stdexcept>
#include <tuple>

#include "shaders.h"

namespace render {
namespace {

struct Vertex {
    float position[3], normal[3], part_object[2];
    GLint first_mode_texel;
};

const Appearance& appearance_of(const Look& look, const std::string& material) {
    for (const auto& [name, appearance] : look.parts) {
        if (name == material) return appearance;
    }
    return look.body;
}

/// Looks of parts, each once, numbered from 1.
class PartTable {
public:
    std::size_t number_of(const Appearance& a) {
        const std::array<float, 6> key = {a.color.x(), a.color.y(), a.color.z(),
                                          a.metallic,  a.roughness, a.lathed};
        const auto [place, is_new] = numbers_.try_emplace(key, numbers_.size() + 1);
        if (is_new) {
            texels_.emplace_back(a.color.x(), a.color.y(), a.color.z(), a.metallic);
            texels_.emplace_back(a.roughness, a.lathed, 0, 0);
        }
        if (numbers_.size() > shaders::kMostParts)
            throw std::runtime_error("picture: error: found more than " +
                                     std::to_string(shaders::kMostParts) +
                                     " different looks of parts, expected fewer");
        return place->second;
    }
    [[nodiscard]] const std::vector<Eigen::Vector4f>& texels() const { return texels_; }

private:
    std::map<std::array<float, 6>, std::size_t> numbers_;
    std::vector<Eigen::Vector4f> texels_;
};

/// Volume by signed tetrahedra; of an open mesh, of its closure towards the bounds' centre.
float volume_of(const Mesh& mesh, const Eigen::Vector3f& center) {
    double six_volumes = 0;
    for (const MeshPart& part : mesh.parts) {
        for (std::size_t i = 0; i < part.indices.size(); i += 3) {
            const Eigen::Vector3d a = (part.positions[part.indices[i]] - center).cast<double>();
            const Eigen::Vector3d b = (part.positions[part.indices[i + 1]] - center).cast<double>();
            const Eigen::Vector3d c = (part.positions[part.indices[i + 2]] - center).cast<double>();
            six_volumes += a.dot(b.cross(c));
        }
    }
    return static_cast<float>(std::abs(six_volumes) / 6);
}

/// `first_texel`: of the mesh's first vertex in the texture of modes, `texels` a vertex.
void append_object(const Mesh& mesh, const Look& look, std::size_t object, GLint first_texel, GLint texels,
                   PartTable& parts, std::vector<Vertex>& vertices, std::vector<GLuint>& indices) {
    GLint texel = first_texel;
    for (const MeshPart& part : mesh.parts) {
        const auto number = static_cast<float>(parts.number_of(appearance_of(look, part.material)));
        const auto base = static_cast<GLuint>(vertices.size());
        for (std::size_t i = 0; i < part.positions.size(); ++i) {
            const Eigen::Vector3f &p = part.positions[i], &n = part.normals[i];
            vertices.push_back(
                {{p.x(), p.y(), p.z()}, {n.x(), n.y(), n.z()}, {number, static_cast<float>(object)}, texel});
            texel += texels;
        }
        for (const std::uint32_t index : part.indices) indices.push_back(base + index);
    }
}

using Reach = std::vector<Eigen::Vector3f>;

/// Of each mode: how far it moves a vertex at most, by component.
Reach reach_of(const ModeShapes& modes) {
    const auto count = static_cast<std::size_t>(modes.count);
    Reach reach(count, Eigen::Vector3f::Zero());
    for (std::size_t i = 0; i < modes.displacement.size(); ++i)
        reach[i % count] = reach[i % count].cwiseMax(modes.displacement[i].cwiseAbs());
    return reach;
}

/// The cofactor matrix: the inverse transpose times the determinant, defined for flattened bodies too.
Eigen::Matrix3f cofactors(const Eigen::Matrix3f& m) {
    Eigen::Matrix3f result;
    result.col(0) = m.col(1).cross(m.col(2));
    result.col(1) = m.col(2).cross(m.col(0));
    result.col(2) = m.col(0).cross(m.col(1));
    return result;
}

const void* offset(std::size_t bytes) {
    return reinterpret_cast<const void*>(bytes);
}

}  // namespace

SceneGeometry::SceneGeometry(const GlFunctions& gl, const SceneDescription& scene, float widening_m)
    : gl_(gl), widening_m_(widening_m), modes_(gl, scene.solids) {
    std::vector<std::filesystem::path> files;
    std::map<std::filesystem::path, std::size_t> number_of_file;
    std::vector<std::size_t> mesh_of_object;
    for (const SceneObject& object : scene.objects) {
        if (object.solid >= static_cast<int>(scene.solids.size()))
            throw std::runtime_error("object " + object.name + ": error: found solid " +
                                     std::to_string(object.solid) + ", expected fewer than " +
                                     std::to_string(scene.solids.size()));
        if (object.solid >= 0) {
            mesh_of_object.push_back(0);
            continue;
        }
        const auto [place, is_new] = number_of_file.try_emplace(object.mesh, files.size());
        if (is_new) files.push_back(object.mesh);
        mesh_of_object.push_back(place->second);
    }
    const std::vector<Mesh> loaded = load_meshes(files);
    std::vector<const Mesh*> meshes;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
        const int solid = scene.objects[i].solid;
        meshes.push_back(solid >= 0 ? &scene.solids[static_cast<std::size_t>(solid)].mesh
                                    : &loaded[mesh_of_object[i]]);
    }
    make_buffers(scene, meshes);
}

void SceneGeometry::make_buffers(const SceneDescription& scene, const std::vector<const Mesh*>& meshes) {
    const std::vector<SceneObject>& objects = scene.objects;
    std::vector<Vertex> vertices;
    std::vector<GLuint> indices;
    PartTable parts;
    std::map<const Mesh*, std::vector<Eigen::Vector3f>> known_corners;
    const auto corners_of = [&](const Mesh* mesh) {
        const auto [place, is_new] = known_corners.try_emplace(mesh);
        if (is_new) place->second = corners_around(*mesh);
        return place->second;
    };
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const Mesh& mesh = *meshes[i];
        const Eigen::AlignedBox3f box = mesh.bounds();
        const int solid = objects[i].solid;
        objects_.push_back(
            {static_cast<GLsizei>(indices.size()),
             static_cast<GLsizei>(3 * mesh.triangles()),
             {box, solid < 0 ? Reach{} : reach_of(scene.solids[static_cast<std::size_t>(solid)].modes),
              corners_of(meshes[i]), objects[i].shadow},
             volume_of(mesh, box.center()),
             modes_.count(solid),
             objects[i].stands});
        append_object(mesh, objects[i].look, i, modes_.first_texel(objects[i].solid),
                      modes_.texels_a_vertex(objects[i].solid), parts, vertices, indices);
    }
    gl_.GenVertexArrays(1, &vertex_array_);
    gl_.BindVertexArray(vertex_array_);
    GLuint buffers[4];
    gl_.GenBuffers(4, buffers);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex)),
                   vertices.data(), GL_STATIC_DRAW);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(GLuint)),
                   indices.data(), GL_STATIC_DRAW);
    const auto attribute = [&](GLuint location, GLint size, std::size_t at) {
        gl_.EnableVertexAttribArray(location);
        gl_.VertexAttribPointer(location, size, GL_FLOAT, GL_FALSE, sizeof(Vertex), offset(at));
    };
    attribute(kPosition, 3, offsetof(Vertex, position));
    attribute(kNormal, 3, offsetof(Vertex, normal));
    attribute(kPartObject, 2, offsetof(Vertex, part_object));
    gl_.EnableVertexAttribArray(kFirstModeTexel);
    gl_.VertexAttribIPointer(kFirstModeTexel, 1, GL_INT, sizeof(Vertex),
                             offset(offsetof(Vertex, first_mode_texel)));
    matrix_buffer_ = buffers[2];
    gl_.GenTextures(1, &matrix_texture_);
    part_buffer_ = buffers[3];
    gl_.BindBuffer(GL_TEXTURE_BUFFER, part_buffer_);
    gl_.BufferData(GL_TEXTURE_BUFFER,
                   static_cast<GLsizeiptr>(parts.texels().size() * sizeof(Eigen::Vector4f)),
                   parts.texels().data(), GL_STATIC_DRAW);
    gl_.GenTextures(1, &part_texture_);
}

void SceneGeometry::bind_parts(GLuint unit) const {
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_BUFFER, part_texture_);
    gl_.TexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, part_buffer_);
}

void SceneGeometry::update(const FrameState& frame, const Eigen::Vector3f& eye) {
    if (frame.world_from_object.size() != objects_.size() || frame.visible.size() != objects_.size()) {
        throw std::invalid_argument("Renderer::draw: found a frame of " +
                                    std::to_string(frame.world_from_object.size()) + " matrices, expected " +
                                    std::to_string(objects_.size()));
    }
    drawn_.clear();
    matrix_rows_.assign(6 * objects_.size(), Eigen::Vector4f::Zero());
    for (std::size_t i = 0; i < objects_.size(); ++i) {
        if (!frame.visible[i]) continue;
        const Eigen::Matrix4f& world_from_object = frame.world_from_object[i];
        if (!world_from_object.allFinite()) {
            throw std::invalid_argument("Renderer::draw: found a matrix that is not finite for object " +
                                        std::to_string(i));
        }
        const Eigen::Matrix3f linear = world_from_object.topLeftCorner<3, 3>();
        const float determinant = linear.determinant();
        const Eigen::Matrix3f normals =
            determinant < 0 ? Eigen::Matrix3f(-cofactors(linear)) : cofactors(linear);
        for (int row = 0; row < 3; ++row) {
            matrix_rows_[6 * i + static_cast<std::size_t>(row)] = world_from_object.row(row).transpose();
            matrix_rows_[6 * i + 3 + static_cast<std::size_t>(row)].head<3>() = normals.row(row).transpose();
        }
        if (objects_[i].bounds.shadow == Shadow::widened) matrix_rows_[6 * i + 5].w() = widening_m_;
        add_modal(frame, i);
        const Eigen::Vector3f center =
            linear * objects_[i].bounds.box.center() + world_from_object.topRightCorner<3, 1>();
        drawn_.push_back({i, (center - eye).norm(), determinant < 0, world_from_object});
    }
    std::stable_sort(drawn_.begin(), drawn_.end(),
                     [](const Drawn& a, const Drawn& b) { return a.distance < b.distance; });
    gl_.BindBuffer(GL_TEXTURE_BUFFER, matrix_buffer_);
    gl_.BufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(matrix_rows_.size() * sizeof(Eigen::Vector4f)),
                   matrix_rows_.data(), GL_STREAM_DRAW);
}

/// Appends the object's coordinates to the rows, four a texel.
void SceneGeometry::add_modal(const FrameState& frame, std::size_t object) {
    const int count = objects_[object].modes;
    if (count == 0) return;
    if (object >= frame.modal.size() || frame.modal[object].size() != count ||
        !frame.modal[object].allFinite()) {
        throw std::invalid_argument("Renderer::draw: found modal coordinates that do not fit object " +
                                    std::to_string(object) + ", expected " + std::to_string(count) +
                                    " finite ones");
    }
    matrix_rows_[6 * object + 3].w() = static_cast<float>(matrix_rows_.size());
    matrix_rows_[6 * object + 4].w() = static_cast<float>(count);
    for (int k = 0; k < count; ++k) {
        if (k % 4 == 0) matrix_rows_.push_back(Eigen::Vector4f::Zero());
        matrix_rows_.back()[k % 4] = frame.modal[object][k];
    }
}

void SceneGeometry::draw(GLuint matrix_unit, GLuint mode_unit, const BoxesOf& boxes_of) const {
    modes_.bind(mode_unit);
    gl_.ActiveTexture(GL_TEXTURE0 + matrix_unit);
    gl_.BindTexture(GL_TEXTURE_BUFFER, matrix_texture_);
    gl_.TexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, matrix_buffer_);
    gl_.BindVertexArray(vertex_array_);
    for (const Drawn& drawn : drawn_) {
        const Object& object = objects_[drawn.object];
        gl_.FrontFace(drawn.mirrored ? GL_CW : GL_CCW);
        for (const PixelBox& box : boxes_of(drawn.object)) {
            gl_.Scissor(box.left, box.bottom, box.right - box.left, box.top - box.bottom);
            gl_.DrawElements(GL_TRIANGLES, object.index_count, GL_UNSIGNED_INT,
                             offset(static_cast<std::size_t>(object.first_index) * sizeof(GLuint)));
        }
    }
    gl_.FrontFace(GL_CCW);
}

std::vector<ObjectBounds> SceneGeometry::bounds() const {
    std::vector<ObjectBounds> all;
    for (const Object& object : objects_) all.push_back(object.bounds);
    return all;
}

std::vector<Eigen::Vector4f> SceneGeometry::volume_balls(std::size_t limit, float least) const {
    std::vector<Eigen::Vector4f> balls;
    for (const Drawn& drawn : drawn_) {
        const Object& object = objects_[drawn.object];
        const Eigen::Matrix4f matrix = object.stands.value_or(drawn.world_from_object);
        const float volume = object.volume * std::abs(matrix.topLeftCorner<3, 3>().determinant());
        Eigen::Vector4f ball = matrix * object.bounds.box.center().homogeneous();
        ball.w() = std::cbrt(volume * 0.75f / std::numbers::pi_v<float>);
        if (ball.w() >= least) balls.push_back(ball);
    }
    // By place where sizes are equal, as the order of drawing follows the objects' motion.
    std::sort(balls.begin(), balls.end(), [](const Eigen::Vector4f& a, const Eigen::Vector4f& b) {
        return std::tuple(-a.w(), a.x(), a.y(), a.z()) < std::tuple(-b.w(), b.x(), b.y(), b.z());
    });
    balls.resize(std::min(limit, balls.size()));
    return balls;
}

std::size_t SceneGeometry::triangles() const {
    std::size_t count = 0;
    for (const Object& object : objects_) count += static_cast<std::size_t>(object.index_count) / 3;
    return count;
}

}  // namespace render
