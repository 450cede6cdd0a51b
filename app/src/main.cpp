#include <CLI/CLI.hpp>

#include "command_line.h"
#include "process/environment.h"
#include "process/standard_streams.h"

int main(int argc, char** argv) {
    app::hold_closed_streams();
    app::clear_mesa_variables();
    CLI::App program("MusicWorld: tracked drumsticks play a virtual kit, predicted ahead of the lag",
                     "musicworld");
    app::add_commands(program);
    return app::run_commands(program, argc, argv);
}
