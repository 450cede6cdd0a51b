#include "osmesa_context.h"

#include <GL/osmesa.h>

#include <stdexcept>

#if defined(__SANITIZE_ADDRESS__)
// OSMesa 22.3 keeps a few hundred bytes a context in a table that it never empties; our own leaks are still
// found.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libOSMesa.so\n";
}
#endif

namespace render {

OsmesaContext::OsmesaContext() {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_STENCIL_BITS,
                              0,
                              OSMESA_ACCUM_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
    context_ = OSMesaCreateContextAttribs(attributes, nullptr);
    if (context_ == nullptr)
        throw std::runtime_error("OSMesa: error: cannot make a context of OpenGL 3.3 core");
    make_current();
}

OsmesaContext::~OsmesaContext() {
    OSMesaDestroyContext(context_);
}

void OsmesaContext::make_current() {
    if (OSMesaGetCurrentContext() == context_) return;
    if (OSMesaMakeCurrent(context_, front_buffer_, GL_UNSIGNED_BYTE, 1, 1) != GL_TRUE) {
        throw std::runtime_error("OSMesa: error: cannot make the context current");
    }
}

OsmesaContext::Function OsmesaContext::function(const char* name) {
    return OSMesaGetProcAddress(name);
}

}  // namespace render
