#include <CLI/CLI.hpp>

#include "bench/bench_command.h"
#include "command_line.h"

int main(int argc, char** argv) {
    CLI::App program("Measure speed beside peers, and speed against error", "musicworld bench");
    app::Command command(program);
    app::add_bench_options(command);
    return app::run_commands(program, argc, argv);
}
