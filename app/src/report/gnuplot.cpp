#include "report/gnuplot.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "files/output_folder.h"
#include "process/child_process.h"

namespace app {
namespace fs = std::filesystem;
namespace {

std::string read_text(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// In the locale C, so that numbers have points, and without the user's start-up files.
void run_gnuplot(const fs::path& script, const fs::path& messages) {
    try {
        run_child({"gnuplot", "--default-settings", script.string()}, messages, {"LC_ALL=C"});
    } catch (const std::runtime_error& failed) {
        throw std::runtime_error(
            fmt::format("{}; the report's plots need gnuplot (package gnuplot-nox)", failed.what()));
    }
}

}  // namespace

std::vector<std::string> draw_svg(const std::vector<PlotScript>& scripts, const fs::path& scratch) {
    const auto svg_file = [&](std::size_t index) { return scratch / fmt::format("plot{:03}.svg", index); };
    std::string commands;
    for (std::size_t i = 0; i < scripts.size(); ++i)
        commands += fmt::format(
            "reset\nset terminal svg size {},{} noenhanced font 'sans-serif,12'\nset output {}\n{}\n"
            "set output\n",
            scripts[i].width, scripts[i].height, gnuplot_string(svg_file(i).string()), scripts[i].commands);
    const fs::path script = scratch / "plots.gp";
    write_file(script, commands);
    run_gnuplot(script, scratch / "plots.log");
    std::vector<std::string> pictures;
    for (std::size_t i = 0; i < scripts.size(); ++i) {
        pictures.push_back(read_text(svg_file(i)));
        if (pictures.back().find("</svg>") == std::string::npos)
            throw std::runtime_error(
                fmt::format("{}: error: found an unfinished plot, expected a whole one; is the "
                            "disk full?",
                            svg_file(i).string()));
    }
    return pictures;
}

std::string gnuplot_string(std::string_view text) {
    std::string quoted = "'";
    for (const char c : text) {
        if (c == '\'') quoted += '\'';
        quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
    return quoted + "'";
}

}  // namespace app
