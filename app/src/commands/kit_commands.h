#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld kit list|show|check|draw|fit|new`.
void add_kit_command(CLI::App& program);

}  // namespace app
