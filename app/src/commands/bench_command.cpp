#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "commands/command.h"
#include "commands/commands.h"
#include "process/child_process.h"

namespace app {
namespace {

/// Does not return.
void become_bench(std::vector<std::string> arguments) {
    const std::string program = program_beside("musicworld_bench").string();
    arguments.insert(arguments.begin(), program);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    execv(program.c_str(), pointers.data());
    throw std::runtime_error(
        fmt::format("error: cannot start {}: {}; `./run bench`, or cmake --build BUILD --target "
                    "musicworld_bench, builds it",
                    program, std::strerror(errno)));
}

}  // namespace

void add_bench_command(Command& program) {
    const Command command = program.command(
        "bench", "Measure speed beside peers, and speed against error (the program musicworld_bench)");
    command->prefix_command();  // that gets all the words that follow, also --help
    command->set_help_flag();
    command->callback([command] { become_bench(command->remaining()); });
}

}  // namespace app
