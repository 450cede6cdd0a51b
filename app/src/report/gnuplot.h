#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace app {

/// The commands of one picture, data inline.
struct PlotScript {
    int width = 640, height = 240;  ///< SVG units
    std::string commands;
};

/// Draws every script with one gnuplot process in the C locale and without the user's start-up files; returns
/// an SVG document a script. Files lie in `scratch`, an existing folder. Throws std::runtime_error when
/// gnuplot is missing or fails.
[[nodiscard]] std::vector<std::string> draw_svg(const std::vector<PlotScript>& scripts,
                                                const std::filesystem::path& scratch);

/// A name as a gnuplot string: quoted so that nothing in it is a command; control characters become spaces.
[[nodiscard]] std::string gnuplot_string(std::string_view text);

}  // namespace app
