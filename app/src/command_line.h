#pragma once

namespace CLI {
class App;
}

namespace app {

/// Parses the arguments, which runs the commands of `program`. Prints errors as one line on standard error.
/// Returns `status` as the command left it, or 1: failed while running; 2: bad usage or bad input.
[[nodiscard]] int run_commands(CLI::App& program, int argc, char** argv, const int& status);

/// The program `musicworld`. Returns 0: done; 1: failed while running; 2: bad usage or bad input.
[[nodiscard]] int run_command_line(int argc, char** argv);

}  // namespace app
