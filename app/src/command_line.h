#pragma once

namespace app {

/// The program: parses the arguments, runs the command, prints errors as one line on standard error.
/// Returns 0: done; 1: failed while running; 2: bad usage or bad input.
[[nodiscard]] int run_command_line(int argc, char** argv);

}  // namespace app
