#include "files/assets.h"

#include <fmt/format.h>

#include <cstdlib>

#include "files/bad_input.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// Of an installation PREFIX/bin/musicworld: PREFIX/share/musicworld/assets; else those of the checkout.
fs::path built_in_assets() {
    std::error_code ignored;
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    fs::path installed = program.parent_path().parent_path() / "share" / "musicworld" / "assets";
    return fs::is_directory(installed / "kits", ignored) ? installed : fs::path(MUSICWORLD_ASSETS);
}

}  // namespace

fs::path assets_folder() {
    const char* chosen = std::getenv("MUSICWORLD_ASSETS");
    if (!chosen || !*chosen) return built_in_assets();
    std::error_code ignored;
    if (!fs::is_directory(fs::path(chosen) / "kits", ignored))
        throw BadInput(fmt::format(
            "{}: error: found no folder kits there, expected the environment variable MUSICWORLD_ASSETS to "
            "name the folder of kits, scenes and traces; correct it or unset it",
            chosen));
    return chosen;
}

fs::path find_kit(const std::string& name_or_path) {
    fs::path bundled = assets_folder() / "kits" / (name_or_path + ".toml");
    if (name_or_path.find('/') == std::string::npos && fs::is_regular_file(bundled)) return bundled;
    return name_or_path;
}

fs::path find_trace(const std::string& name_or_path) {
    fs::path bundled = assets_folder() / "traces" / (name_or_path + ".csv");
    const bool name = name_or_path.find('/') == std::string::npos;
    std::error_code ignored;
    if (name && !fs::exists(name_or_path, ignored) && fs::is_regular_file(bundled, ignored)) return bundled;
    return name_or_path;
}

}  // namespace app
