#include "command_line.h"

#include <audio/samples.h>
#include <fmt/format.h>
#include <poll.h>
#include <render/mesh.h>
#include <sim/errors.h>
#include <tracking/trace.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <new>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/manual.h"
#include "commands/play_command.h"
#include "files/bad_input.h"
#include "process/environment.h"
#include "process/standard_streams.h"

namespace app {
namespace {

constexpr int kFailed = 1, kBadInput = 2;
#ifdef MUSICWORLD_BASELINE
constexpr const char* kLevel = "x86-64";
#else
constexpr const char* kLevel = "x86-64-v3";
#endif

int complain(const std::string& message, int status) {
    tell(message);
    return status;
}

std::string full_name(const CLI::App& command) {
    return command.get_parent() ? full_name(*command.get_parent()) + " " + command.get_name()
                                : command.get_name();
}

/// What to use in place of an option that is there no more; empty: it never was.
std::string instead_of(const std::string& command, const std::string& option) {
    const std::string name = option.substr(0, option.find('='));
    if (command != "musicworld simulate" || (name != "--mode" && name != "--verify")) return {};
    return fmt::format(
        "found {}, which is gone, expected --bound B: workers are always out of step by at most B steps, "
        "and 0 is a barrier after each step; for the bits of one process use --workers 0 with --threads N",
        name);
}

/// "found ..., expected ..." for a line that CLI11 did not understand; `at` is the last command that it did.
std::string explain(const CLI::App& at, const std::string& what) {
    const std::string name = full_name(at), help = fmt::format("see `{} --help`", name);
    const std::vector<std::string> rest = at.remaining();
    const DeclaredCommand declared = declared_commands(at).front();
    if (!declared.commands.empty() && rest.empty())
        return fmt::format("found no command, expected {}; usage: `{} COMMAND ...`",
                           one_of(declared.commands), name);
    if (!declared.commands.empty())
        return fmt::format("found `{} {}`, expected {}{}", name, rest.front(), one_of(declared.commands),
                           nearest_hint(rest.front(), declared.commands));
    std::vector<std::string> options = {"--help"};
    for (const DeclaredOption& option : declared.options)
        if (!option.argument()) options.push_back(option.name);
    for (const std::string& word : rest)
        if (const std::string instead = instead_of(name, word); !instead.empty()) return instead;
    if (!rest.empty() && rest.front().starts_with('-'))
        return fmt::format("found {}, expected an option of `{}`{}", rest.front(), name,
                           nearest_hint(rest.front(), options));
    if (!rest.empty())
        return fmt::format("found argument {}, expected no more of `{}`; {}", rest.front(), name, help);
    for (const auto& [words, meaning] : {std::pair(" is required", "found no {}, expected one; {}"),
                                         {" excludes ", "found {} with {}, expected one of them; {}"},
                                         {" requires ", "found {} without {}, expected both; {}"}})
        if (const std::size_t k = what.find(words); k != std::string::npos) {
            const std::string first = what.substr(0, k), second = what.substr(k + std::string(words).size());
            return second.empty() ? fmt::format(fmt::runtime(meaning), first, help)
                                  : fmt::format(fmt::runtime(meaning), first, second, help);
        }
    return fmt::format("found bad usage of `{}` ({}), expected what its help tells; {}", name, what, help);
}

int parse(CLI::App& program, int argc, char** argv) {
    try {
        program.parse(argc, argv);
    } catch (const CLI::Success& help_or_version) {
        return program.exit(help_or_version);
    } catch (const CLI::ParseError& wrong) {
        const CLI::App* at = &program;
        while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
        return complain("error: " + explain(*at, wrong.what()), kBadInput);
    } catch (const ExitStatus& ended) {
        return ended.status;
    }
    return 0;
}

/// Whoever read standard output has closed it, as `head` does when it has enough.
bool reader_left() {
    pollfd out{STDOUT_FILENO, POLLOUT, 0};
    return std::ferror(stdout) != 0 && ::poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

int parse_and_report(CLI::App& program, int argc, char** argv) {
    try {
        const int status = parse(program, argc, argv);
        if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
        if (reader_left()) return status;
        return complain("error: cannot write to standard output", kFailed);
    } catch (const BadInput& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const tracking::TraceError& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const render::MeshError& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const audio::SampleError& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const sim::InputError& wrong) {
        return complain(fmt::format("error: {}", wrong.what()), kBadInput);
    } catch (const sim::WorkerError& wrong) {
        return complain(fmt::format("error: {}", wrong.what()), kFailed);
    } catch (const std::invalid_argument& wrong) {
        return complain(wrong.what(), kBadInput);
    } catch (const std::bad_alloc&) {
        return complain("error: found too little memory, expected enough for this input", kFailed);
    } catch (const std::exception& wrong) {
        return reader_left() ? kFailed : complain(wrong.what(), kFailed);
    }
}

}  // namespace

void add_commands(CLI::App& tree) {
    tree.set_version_flag(
        "--version",
        [] {
            return fmt::format("musicworld {}\nbuild: GCC {}, {}, {}\nlibraries: {}", MUSICWORLD_VERSION,
                               __VERSION__, MUSICWORLD_BUILD_TYPE, kLevel, MUSICWORLD_LIBRARIES);
        },
        "Print the version, the build and the libraries");
    Command program(tree);
    add_play_command(program);
    add_predict_command(program);
    add_train_command(program);
    add_kit_command(program);
    add_compare_command(program);
    add_latency_command(program);
    add_trace_command(program);
    add_record_command(program);
    add_modes_command(program);
    add_bench_command(program);
    add_simulate_command(program);
    add_worker_commands(program);
    add_schema_command(program);
    add_manual_commands(program, tree);
}

int run_commands(CLI::App& program, int argc, char** argv) {
    // A file that may not grow and a reader that went away are errors to report, not reasons to die at once.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    if (const unsigned long limit = raise_descriptor_limit(); limit < kLeastDescriptors)
        return complain(
            fmt::format("error: found a limit of {} open files, expected at least {}; see `ulimit -n`", limit,
                        kLeastDescriptors),
            kFailed);
    const int status = parse_and_report(program, argc, argv);
    if (reader_left()) {  // now, with everything in order, end as other tools do
        std::signal(SIGPIPE, SIG_DFL);
        std::raise(SIGPIPE);
    }
    return status;
}

}  // namespace app
