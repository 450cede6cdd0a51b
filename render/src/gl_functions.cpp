#include "gl_functions.h"

#include <stdexcept>
#include <string>

namespace render {
namespace {

template <typename Function>
void load(const GlContext& context, Function& function, const char* name) {
    function = reinterpret_cast<Function>(context.function(name));
    if (function == nullptr) {
        throw std::runtime_error(std::string(context.name()) + ": error: no function " + name +
                                 "; OpenGL 3.3 core is needed");
    }
}

}  // namespace

GlFunctions::GlFunctions(const GlContext& context) {
#define RENDER_GL_LOAD(type, name) load(context, name, "gl" #name);
    RENDER_GL_FUNCTIONS(RENDER_GL_LOAD)
#undef RENDER_GL_LOAD
}

}  // namespace render
