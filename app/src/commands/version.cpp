#include "commands/version.h"

#include <fmt/format.h>

namespace app {

std::string version_text() {
#ifdef MUSICWORLD_BASELINE
    constexpr std::string_view kLevel = "x86-64";
#else
    constexpr std::string_view kLevel = "x86-64-v3";
#endif
    return fmt::format("musicworld {}\nbuild: GCC {}, {}, {}\nlibraries: {}", MUSICWORLD_VERSION, __VERSION__,
                       MUSICWORLD_BUILD_TYPE, kLevel, MUSICWORLD_LIBRARIES);
}

}  // namespace app
