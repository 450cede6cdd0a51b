#pragma once
#include <filesystem>
#include <string>

namespace app {

/// The folder of the bundled files; MUSICWORLD_ASSETS in the environment overrides the built-in one.
/// Throws BadInput where that is no such folder.
[[nodiscard]] std::filesystem::path assets_folder();

/// A kit by path, or by the name of a bundled one ("drums" is assets/kits/drums.toml).
[[nodiscard]] std::filesystem::path find_kit(const std::string& name_or_path);

/// A trace by path, or by the name of a bundled one ("flourish" is assets/traces/flourish.csv).
[[nodiscard]] std::filesystem::path find_trace(const std::string& name_or_path);

}  // namespace app
