#include "command_line.h"

#include <fmt/format.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <new>

#include "bad_input.h"
#include "compare_command.h"
#include "kit_commands.h"
#include "play_command.h"
#include "predict_command.h"
#include "trace_commands.h"

namespace app {
namespace {

constexpr int kFailed = 1, kBadInput = 2;

int complain(std::string message, int status) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    fmt::print(stderr, "{}\n", message);
    return status;
}

void add_worker_command(CLI::App& program, int& status) {
    CLI::App* worker = program.add_subcommand("worker", "Join a simulation (started by the program itself)");
    auto endpoint = std::make_shared<std::string>();
    worker->add_option("--connect", *endpoint, "ZeroMQ endpoint of the application")->required();
    worker->callback([endpoint, &status] { status = sim::run_worker(*endpoint); });
}

int run(int argc, char** argv) {
    CLI::App program("MusicWorld: tracked drumsticks play a virtual kit, predicted ahead of the lag",
                     "musicworld");
    program.set_version_flag("--version", MUSICWORLD_VERSION);
    program.require_subcommand(1);
    int status = 0;
    add_play_command(program);
    add_predict_command(program);
    add_kit_command(program);
    add_compare_command(program);
    add_trace_command(program);
    add_worker_command(program, status);
    try {
        program.parse(argc, argv);
    } catch (const CLI::CallForHelp& help) {
        return program.exit(help);
    } catch (const CLI::CallForAllHelp& help) {
        return program.exit(help);
    } catch (const CLI::CallForVersion& version) {
        return program.exit(version);
    } catch (const CLI::ParseError& wrong) {
        const std::string typed = fmt::format("musicworld {}", fmt::join(argv + 1, argv + argc, " "));
        return complain(
            fmt::format("error: found bad usage in `{}` ({}), expected what `musicworld --help` tells", typed,
                        wrong.what()),
            kBadInput);
    }
    return status;
}

}  // namespace

int run_command_line(int argc, char** argv) {
    try {
        return run(argc, argv);
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

}  // namespace app
