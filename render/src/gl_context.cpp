#include "gl_context.h"

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>
#include <string_view>

#if defined(__SANITIZE_ADDRESS__)
// Mesa 22.3 keeps a few hundred bytes a context in a table that it never empties; our own leaks are still found.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libOSMesa.so\nleak:libEGL\nleak:swrast_dri.so\n";
}
#endif

namespace render {
namespace {

/// A library loaded for the rest of the process: OpenGL drivers do not survive being unloaded.
class Library {
public:
    Library(const char* file, const char* remedy)
        : file_(file), handle_(dlopen(file, RTLD_NOW | RTLD_LOCAL)) {
        if (handle_ == nullptr)
            throw std::runtime_error(std::string("OpenGL: error: cannot load ") + file + "; " + remedy);
    }

    template <typename Type>
    void load(Type& function, const char* name) const {
        function = reinterpret_cast<Type>(dlsym(handle_, name));
        if (function == nullptr)
            throw std::runtime_error(std::string(file_) + ": error: no function " + name);
    }

private:
    const char* file_;
    void* handle_;
};

/// GL/osmesa.h, as far as it is used.
class Osmesa : public GlContext::BackEnd {
public:
    Osmesa() {
        library_.load(create_, "OSMesaCreateContextAttribs");
        library_.load(destroy_, "OSMesaDestroyContext");
        library_.load(current_, "OSMesaGetCurrentContext");
        library_.load(make_current_, "OSMesaMakeCurrent");
        library_.load(address_, "OSMesaGetProcAddress");
        constexpr int kFormat = 0x22, kRgba = 0x1908, kDepth = 0x30, kStencil = 0x31, kAccumulation = 0x32,
                      kProfile = 0x33, kCore = 0x34, kMajor = 0x36, kMinor = 0x37;
        const int attributes[] = {kFormat, kRgba,  kDepth, 0,      kStencil, 0, kAccumulation, 0, kProfile,
                                  kCore,   kMajor, 3,      kMinor, 3,        0};
        context_ = create_(attributes, nullptr);
        if (context_ == nullptr)
            throw std::runtime_error("OSMesa: error: cannot make a context of OpenGL 3.3 core");
    }
    ~Osmesa() override {
        if (context_ != nullptr) destroy_(context_);
    }

    void make_current() override {
        if (current_() == context_) return;
        constexpr unsigned kUnsignedByte = 0x1401;
        if (make_current_(context_, front_buffer_, kUnsignedByte, 1, 1) == 0)
            throw std::runtime_error("OSMesa: error: cannot make the context current");
    }
    [[nodiscard]] const char* name() const override { return "OSMesa"; }
    [[nodiscard]] GlContext::Function function(const char* name) const override { return address_(name); }

private:
    Library library_{"libOSMesa.so.8", "install the package libosmesa6"};
    void* (*create_)(const int*, void*);
    void (*destroy_)(void*);
    void* (*current_)();
    unsigned char (*make_current_)(void*, void*, unsigned, int, int);
    GlContext::Function (*address_)(const char*);
    void* context_ = nullptr;
    std::uint8_t front_buffer_[4] = {};  // it wants one; frames are drawn into framebuffer objects
};

/// EGL 1.5, as far as it is used.
class Egl : public GlContext::BackEnd {
public:
    Egl() {
        library_.load(get_display_, "eglGetPlatformDisplay");
        library_.load(initialize_, "eglInitialize");
        library_.load(bind_api_, "eglBindAPI");
        library_.load(choose_, "eglChooseConfig");
        library_.load(create_, "eglCreateContext");
        library_.load(destroy_, "eglDestroyContext");
        library_.load(current_, "eglGetCurrentContext");
        library_.load(make_current_, "eglMakeCurrent");
        library_.load(address_, "eglGetProcAddress");
        constexpr unsigned kSurfaceless = 0x31DD, kOpenGl = 0x30A2;
        constexpr int kMajor = 0x3098, kMinor = 0x30FB, kProfile = 0x30FD, kCore = 1, kEnd = 0x3038;
        constexpr int kSurface = 0x3033, kRenderable = 0x3040, kOpenGlBit = 8;
        display_ = get_display_(kSurfaceless, nullptr, nullptr);
        if (display_ == nullptr || initialize_(display_, nullptr, nullptr) == 0)
            throw std::runtime_error(
                "EGL: error: found no display without a screen (EGL_MESA_platform_surfaceless); install the "
                "packages libegl-mesa0 and libgl1-mesa-dri");
        const int wanted[] = {kSurface, 0, kRenderable, kOpenGlBit, kEnd};
        const int attributes[] = {kMajor, 3, kMinor, 3, kProfile, kCore, kEnd};
        void* config = nullptr;
        int found = 0;
        if (bind_api_(kOpenGl) != 0 && choose_(display_, wanted, &config, 1, &found) != 0 && found > 0)
            context_ = create_(display_, config, nullptr, attributes);
        if (context_ == nullptr)
            throw std::runtime_error("EGL: error: cannot make a context of OpenGL 3.3 core");
    }
    ~Egl() override {
        if (context_ == nullptr) return;
        if (current_() == context_) make_current_(display_, nullptr, nullptr, nullptr);
        destroy_(display_, context_);
    }

    void make_current() override {
        if (current_() == context_) return;
        if (make_current_(display_, nullptr, nullptr, context_) == 0)
            throw std::runtime_error("EGL: error: cannot make the context current");
    }
    [[nodiscard]] const char* name() const override { return "EGL"; }
    [[nodiscard]] GlContext::Function function(const char* name) const override { return address_(name); }

private:
    Library library_{"libEGL.so.1", "install the packages libegl1 and libegl-mesa0"};
    void* (*get_display_)(unsigned, void*, const std::intptr_t*);
    unsigned (*initialize_)(void*, int*, int*);
    unsigned (*bind_api_)(unsigned);
    unsigned (*choose_)(void*, const int*, void**, int, int*);
    void* (*create_)(void*, void*, void*, const int*);
    unsigned (*destroy_)(void*, void*);
    void* (*current_)();
    unsigned (*make_current_)(void*, void*, void*, void*);
    GlContext::Function (*address_)(const char*);
    void *display_ = nullptr, *context_ = nullptr;
};

std::unique_ptr<GlContext::BackEnd> chosen_back_end() {
    const char* chosen = std::getenv("MUSICWORLD_GL");  // NOLINT: nobody writes the environment later
    const std::string_view name = chosen == nullptr ? "" : chosen;
    if (name.empty() || name == "osmesa") return std::make_unique<Osmesa>();
    if (name == "egl") return std::make_unique<Egl>();
    throw std::invalid_argument("MUSICWORLD_GL: error: found \"" + std::string(name) +
                                "\", expected osmesa or egl");
}

}  // namespace

GlContext::GlContext() : back_end_(chosen_back_end()) {
    make_current();
}

GlContext::~GlContext() = default;

}  // namespace render
