#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// The folder of the bundled files; MUSICWORLD_ASSETS in the environment overrides the built-in one.
/// Throws BadInput where that is no such folder.
[[nodiscard]] std::filesystem::path assets_folder();

/// The NAMEs of the files NAME + extension in a folder of the assets.
[[nodiscard]] std::vector<std::string> bundled_names(const std::string& folder,
                                                     const std::string& extension = ".toml");
/// A file by path, or by the name of a bundled one: NAME + extension in a folder of the assets. Throws BadInput
/// with the nearest name if there is neither.
[[nodiscard]] std::filesystem::path find_bundled(const std::string& name_or_path, const std::string& folder,
                                                 const std::string& extension = ".toml");
/// A kit by path, or by the name of a bundled one ("drums" is assets/kits/drums.toml).
[[nodiscard]] inline std::filesystem::path find_kit(const std::string& name_or_path) {
    return find_bundled(name_or_path, "kits");
}
/// A trace by path, or, where there is no such file, by the name of a bundled one ("flourish" is
/// assets/traces/flourish.csv).
[[nodiscard]] std::filesystem::path find_trace(const std::string& name_or_path);

}  // namespace app
