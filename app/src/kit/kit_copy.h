#pragma once
#include <filesystem>

namespace app {

/// Writes a copy of a kit that needs nothing but the bundled files: its text to `out`, and what it includes and its own
/// meshes, samples and orchestras to the folder STEM-files beside that, with the names in the texts changed and all else
/// as it was, comments too. Included kits are copied even where they are bundled; bundled meshes stay where they are.
/// Throws BadInput for a kit that cannot be read, and for samples that cannot be moved (absolute paths in an SFZ file).
void copy_kit(const std::filesystem::path& kit, const std::filesystem::path& out);

}  // namespace app
