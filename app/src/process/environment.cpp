#include "process/environment.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace app {
namespace {

constexpr std::array<std::string_view, 14> kMesaPrefixes = {
    "MESA_", "GALLIUM_", "GALLIVM_", "LP_",  "LIBGL_", "OSMESA_", "SOFTPIPE_",
    "ST_",   "DRAW_",    "TGSI_",    "NIR_", "GLSL_",  "EGL_",    "LIBGALLIUM_"};

bool is_of_mesa(std::string_view entry) {
    return !entry.starts_with("LP_NUM_THREADS=") &&
           std::ranges::any_of(kMesaPrefixes,
                               [&](std::string_view prefix) { return entry.starts_with(prefix); });
}

}  // namespace

void clear_mesa_variables() {
    std::vector<std::string> names;
    for (char** entry = environ; *entry != nullptr; ++entry)
        if (const std::string_view text = *entry; is_of_mesa(text))
            names.emplace_back(text.substr(0, text.find('=')));
    for (const std::string& name : names) unsetenv(name.c_str());
}

unsigned long raise_descriptor_limit() noexcept {
    rlimit limit{};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return kLeastDescriptors;
    limit.rlim_cur = limit.rlim_max;
    (void)setrlimit(RLIMIT_NOFILE, &limit);
    return limit.rlim_cur;
}

}  // namespace app
