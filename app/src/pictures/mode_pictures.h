#pragma once
#include <sim/modes.h>

#include <filesystem>

namespace app {

/// Draws the lowest modes as figure 2-3 of the thesis does: the body with a chequered skin, deformed by each
/// mode in turn, its largest displacement 0.2 of the body's mean extent. At most `most` of them:
/// FOLDER/000001.png for the first mode and so on, and all of them side by side, in rows of six, into `sheet`.
/// Throws std::runtime_error.
void draw_modes(const sim::ModesRequest& request, const sim::ModalBasis& basis, int most,
                const std::filesystem::path& folder, const std::filesystem::path& sheet);

}  // namespace app
