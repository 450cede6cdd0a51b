#include "command_line.h"

#include <fmt/format.h>
#include <tracking/trace.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <new>

#include "commands/bench_command.h"
#include "commands/compare_command.h"
#include "commands/keys_command.h"
#include "commands/kit_commands.h"
#include "commands/latency_command.h"
#include "commands/modes_command.h"
#include "commands/play_command.h"
#include "commands/predict_command.h"
#include "commands/record_command.h"
#include "commands/schema_command.h"
#include "commands/simulate_command.h"
#include "commands/trace_commands.h"
#include "files/bad_input.h"
#include "sensors/sensor_process.h"

namespace app {
namespace {

constexpr int kFailed = 1, kBadInput = 2;

int complain(std::string message, int status) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    fmt::print(stderr, "{}\n", message);
    return status;
}

std::string full_name(const CLI::App& command) {
    return command.get_parent() ? full_name(*command.get_parent()) + " " + command.get_name()
                                : command.get_name();
}

/// The commands that could have followed the last one that was understood.
std::string what_to_say(const CLI::App& program) {
    const CLI::App* at = &program;
    while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
    std::vector<std::string> names;
    for (const CLI::App* command : at->get_subcommands(nullptr))
        if (command->get_name() != "worker" && command->get_name() != "sensor")
            names.push_back(command->get_name());
    if (names.empty()) return fmt::format("what `{} --help` tells", full_name(*at));
    return fmt::format("`{}` and one of {}", full_name(*at), fmt::join(names, ", "));
}

int parse(CLI::App& program, int argc, char** argv, const int& status) {
    try {
        program.parse(argc, argv);
    } catch (const CLI::CallForHelp& help) {
        return program.exit(help);
    } catch (const CLI::CallForAllHelp& help) {
        return program.exit(help);
    } catch (const CLI::CallForVersion& version) {
        return program.exit(version);
    } catch (const CLI::ParseError& wrong) {
        const std::string typed =
            fmt::format("{} {}", program.get_name(), fmt::join(argv + 1, argv + argc, " "));
        return complain(fmt::format("error: found bad usage in `{}` ({}), expected {}", typed, wrong.what(),
                                    what_to_say(program)),
                        kBadInput);
    }
    return status;
}

}  // namespace

int run_commands(CLI::App& program, int argc, char** argv, const int& status) {
    // A file that may not grow and a reader that went away are errors to report, not reasons to die.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    try {
        const int status_at_end = parse(program, argc, argv, status);
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            return complain("error: found standard output that takes no more, expected room for the result",
                            kFailed);
        return status_at_end;
    } catch (const BadInput& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const tracking::TraceError& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const std::invalid_argument& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const std::bad_alloc&) {
        return complain("error: found too little memory, expected enough for this input", kFailed);
    } catch (const std::exception& wrong) {
        return complain(wrong.what(), kFailed);
    }
}

int run_command_line(int argc, char** argv) {
    CLI::App program("MusicWorld: tracked drumsticks play a virtual kit, predicted ahead of the lag",
                     "musicworld");
    program.set_version_flag("--version", MUSICWORLD_VERSION);
    program.require_subcommand(1);
    int status = 0;
    add_play_command(program);
    add_predict_command(program);
    add_kit_command(program);
    add_compare_command(program);
    add_latency_command(program);
    add_trace_command(program);
    add_record_command(program);
    add_modes_command(program);
    add_bench_command(program);
    add_simulate_command(program, status);
    add_keys_command(program);
    add_schema_command(program);
    add_worker_command(program, status);
    add_sensor_command(program, status);
    return run_commands(program, argc, argv, status);
}

}  // namespace app
