#include "gl_functions.h"

#include <stdexcept>
#include <string>

#include "osmesa_context.h"

namespace render {
namespace {

template <typename Function>
void load(Function& function, const char* name) {
    function = reinterpret_cast<Function>(OsmesaContext::function(name));
    if (function == nullptr) {
        throw std::runtime_error(std::string("OSMesa: error: no function ") + name +
                                 "; OpenGL 3.3 core is needed");
    }
}

}  // namespace

GlFunctions::GlFunctions() {
#define RENDER_GL_LOAD(type, name) load(name, "gl" #name);
    RENDER_GL_FUNCTIONS(RENDER_GL_LOAD)
#undef RENDER_GL_LOAD
}

}  // namespace render
