#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld trace convert IN... --out FILE.csv`.
void add_convert_command(CLI::App& trace);

}  // namespace app
