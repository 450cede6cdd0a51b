#pragma once
#include <CLI/CLI.hpp>

namespace app {

/// `musicworld schema kit|scene|map [--markdown]`: the JSON Schema or the reference page of a file format.
void add_schema_command(CLI::App& program);

}  // namespace app
