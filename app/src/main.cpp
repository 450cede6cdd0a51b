#include <CLI/CLI.hpp>

#include "command_line.h"

int main(int argc, char** argv) {
    CLI::App program("MusicWorld: tracked drumsticks play a virtual kit, predicted ahead of the lag",
                     "musicworld");
    app::add_commands(program);
    return app::run_commands(program, argc, argv);
}
