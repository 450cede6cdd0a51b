#include "files/assets.h"

#include <fmt/format.h>

#include <algorithm>
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

std::vector<std::string> bundled_names(const std::string& folder, const std::string& extension) {
    std::vector<std::string> names;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(assets_folder() / folder, ignored))
        if (entry.path().extension() == extension && entry.path().stem() != "defaults")
            names.push_back(entry.path().stem().string());
    std::ranges::sort(names);
    return names;
}

fs::path find_bundled(const std::string& name_or_path, const std::string& folder,
                      const std::string& extension) {
    std::error_code error;
    fs::path bundled = assets_folder() / folder / (name_or_path + extension);
    // "hard/table" is of a folder within, unless there is such a file here.
    const bool name = name_or_path.find('/') == std::string::npos ||
                      (fs::path(name_or_path).is_relative() && !fs::exists(name_or_path, error));
    if (name && fs::is_regular_file(bundled, error)) return bundled;
    const std::vector<std::string> names = bundled_names(folder, extension);
    if (fs::status(name_or_path, error).type() == fs::file_type::not_found && !names.empty())
        throw BadInput(fmt::format("{}: error: found no such file, expected a {}; the bundled ones are {}{}",
                                   name_or_path, folder.substr(0, folder.size() - 1), fmt::join(names, ", "),
                                   nearest_hint(fs::path(name_or_path).stem().string(), names)));
    return name_or_path;
}

fs::path find_trace(const std::string& name_or_path) {
    std::error_code ignored;
    if (fs::exists(name_or_path, ignored)) return name_or_path;
    return find_bundled(name_or_path, "traces", ".csv");
}

}  // namespace app
