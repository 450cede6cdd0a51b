#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "gl_functions.h"

namespace render {

/// A linked vertex and fragment shader. Ends with its context.
class GlProgram {
public:
    /// Throws std::runtime_error with the compiler's message.
    GlProgram(const GlFunctions& gl, const std::string& vertex_source, const std::string& fragment_source);

    void use() const;
    // The program must be in use. Unknown names are ignored: the compiler drops uniforms without effect.
    void set(const char* name, int value) const;
    void set(const char* name, float value) const;
    void set(const char* name, const Eigen::Vector2f& value) const;
    void set(const char* name, const Eigen::Vector3f& value) const;
    void set(const char* name, const Eigen::Matrix4f& value) const;
    void set(const char* name, const std::vector<Eigen::Vector4f>& values) const;

private:
    const GlFunctions& gl_;
    GLuint program_;
};

}  // namespace render
