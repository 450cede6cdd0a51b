#include "gl_program.h"

#include <stdexcept>

namespace render {
namespace {

GLuint compile(const GlFunctions& gl, GLenum kind, const std::string& source) {
    const GLuint shader = gl.CreateShader(kind);
    const char* text = source.c_str();
    gl.ShaderSource(shader, 1, &text, nullptr);
    gl.CompileShader(shader);
    GLint compiled = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return shader;
    std::string log(4096, '\0');
    gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw std::runtime_error("OpenGL: error: cannot compile a shader: " + std::string(log.c_str()));
}

}  // namespace

GlProgram::GlProgram(const GlFunctions& gl, const std::string& vertex_source,
                     const std::string& fragment_source)
    : gl_(gl), program_(gl.CreateProgram()) {
    gl_.AttachShader(program_, compile(gl, GL_VERTEX_SHADER, vertex_source));
    gl_.AttachShader(program_, compile(gl, GL_FRAGMENT_SHADER, fragment_source));
    gl_.LinkProgram(program_);
    GLint linked = 0;
    gl_.GetProgramiv(program_, GL_LINK_STATUS, &linked);
    if (linked == GL_TRUE) return;
    std::string log(4096, '\0');
    gl_.GetProgramInfoLog(program_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw std::runtime_error("OpenGL: error: cannot link shaders: " + std::string(log.c_str()));
}

void GlProgram::use() const {
    gl_.UseProgram(program_);
}

void GlProgram::set(const char* name, int value) const {
    gl_.Uniform1i(gl_.GetUniformLocation(program_, name), value);
}

void GlProgram::set(const char* name, float value) const {
    gl_.Uniform1f(gl_.GetUniformLocation(program_, name), value);
}

void GlProgram::set(const char* name, const Eigen::Vector2f& value) const {
    gl_.Uniform2fv(gl_.GetUniformLocation(program_, name), 1, value.data());
}

void GlProgram::set(const char* name, const Eigen::Vector3f& value) const {
    gl_.Uniform3fv(gl_.GetUniformLocation(program_, name), 1, value.data());
}

void GlProgram::set(const char* name, const Eigen::Matrix4f& value) const {
    gl_.UniformMatrix4fv(gl_.GetUniformLocation(program_, name), 1, GL_FALSE, value.data());
}

void GlProgram::set(const char* name, const std::vector<Eigen::Vector4f>& values) const {
    if (values.empty()) return;
    gl_.Uniform4fv(gl_.GetUniformLocation(program_, name), static_cast<GLsizei>(values.size()),
                   values.front().data());
}

}  // namespace render
