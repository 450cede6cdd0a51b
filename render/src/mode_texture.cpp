#include "mode_texture.h"

#include <Eigen/Geometry>
#include <stdexcept>
#include <string>

namespace render {
namespace {

std::size_t vertices_of(const Mesh& mesh) {
    std::size_t count = 0;
    for (const MeshPart& part : mesh.parts) count += part.positions.size();
    return count;
}

void check(const Solid& solid, std::size_t number) {
    const std::size_t expected = vertices_of(solid.mesh) * static_cast<std::size_t>(solid.modes.count);
    if (solid.modes.displacement.size() == expected && solid.modes.gradient.size() == expected) return;
    throw std::runtime_error("solid " + std::to_string(number) + ": error: found " +
                             std::to_string(solid.modes.displacement.size()) + " displacements and " +
                             std::to_string(solid.modes.gradient.size()) + " gradients, expected " +
                             std::to_string(expected) + " of each (vertices times modes)");
}

Eigen::Vector4f texel(const Eigen::Vector3f& v) {
    return {v.x(), v.y(), v.z(), 0};
}

void append(const Solid& solid, std::vector<Eigen::Vector4f>& texels) {
    const auto count = static_cast<std::size_t>(solid.modes.count);
    std::size_t at = 0;
    for (const MeshPart& part : solid.mesh.parts) {
        for (const Eigen::Vector3f& normal : part.normals) {
            const Eigen::Vector3f t1 = normal.unitOrthogonal(), t2 = normal.cross(t1);
            texels.push_back(texel(t1));
            texels.push_back(texel(t2));
            for (std::size_t k = 0; k < count; ++k, ++at) {
                texels.push_back(texel(solid.modes.displacement[at]));
                texels.push_back(texel(solid.modes.gradient[at] * t1));
                texels.push_back(texel(solid.modes.gradient[at] * t2));
            }
        }
    }
}

}  // namespace

ModeTexture::ModeTexture(const GlFunctions& gl, const std::vector<Solid>& solids) : gl_(gl) {
    std::vector<Eigen::Vector4f> texels;
    for (const Solid& solid : solids) {
        check(solid, places_.size());
        places_.push_back({solid.modes.count, static_cast<GLint>(texels.size())});
        if (solid.modes.count > 0) append(solid, texels);
    }
    if (texels.empty()) return;
    GLint most = 0;
    gl_.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
    if (texels.size() > static_cast<std::size_t>(most)) {
        throw std::runtime_error("picture: error: found mode shapes of " + std::to_string(texels.size()) +
                                 " values, expected at most " + std::to_string(most) +
                                 "; draw fewer bending bodies");
    }
    gl_.GenBuffers(1, &buffer_);
    gl_.BindBuffer(GL_TEXTURE_BUFFER, buffer_);
    gl_.BufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(texels.size() * sizeof(Eigen::Vector4f)),
                   texels.data(), GL_STATIC_DRAW);
    gl_.GenTextures(1, &texture_);
}

void ModeTexture::bind(GLuint unit) const {
    if (empty()) return;
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_BUFFER, texture_);
    gl_.TexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, buffer_);
}

}  // namespace render
