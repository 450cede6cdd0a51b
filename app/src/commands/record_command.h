#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld record`.
void add_record_command(CLI::App& program);

}  // namespace app
