#pragma once

namespace CLI {
class App;
}

namespace app {

/// Adds all commands of musicworld to `program`.
void add_commands(CLI::App& program);

/// Parses the arguments, which runs one of the commands of `program`. Prints errors as one line on standard
/// error. Returns 0: done; 1: failed while running; 2: bad usage or bad input; or what the command ended with.
[[nodiscard]] int run_commands(CLI::App& program, int argc, char** argv);

}  // namespace app
