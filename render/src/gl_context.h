#pragma once
#include <cstdint>
#include <memory>
#include <string>

namespace render {

/// An off-screen OpenGL 3.3 core context: of OSMesa (software; the default), or of EGL without a display or surface
/// (EGL_MESA_platform_surfaceless: by a graphics driver, or by software where none is). The environment variable
/// MUSICWORLD_GL says which: osmesa or egl. Only the library chosen is loaded, as each brings an OpenGL of its own.
/// Objects made in a context end with it.
class GlContext {
public:
    /// Makes the context and makes it current. Throws std::runtime_error where the library is missing or makes none.
    GlContext();
    ~GlContext();
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    /// Makes it current on the calling thread. Cheap when it already is.
    void make_current() { back_end_->make_current(); }
    /// "OSMesa" or "EGL".
    [[nodiscard]] const char* name() const { return back_end_->name(); }

    using Function = void (*)();
    /// Address of an OpenGL function; null for an unknown name.
    [[nodiscard]] Function function(const char* name) const { return back_end_->function(name); }

    /// Of one library. Its destructor ends the context.
    class BackEnd {
    public:
        BackEnd() = default;
        virtual ~BackEnd() = default;
        BackEnd(const BackEnd&) = delete;
        BackEnd& operator=(const BackEnd&) = delete;
        virtual void make_current() = 0;
        [[nodiscard]] virtual const char* name() const = 0;
        [[nodiscard]] virtual Function function(const char* name) const = 0;
    };

private:
    std::unique_ptr<BackEnd> back_end_;
};

}  // namespace render
