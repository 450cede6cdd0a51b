#include "simulate/worker_options.h"

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/option_values.h"

namespace app {
namespace {

constexpr int kMostWorkers = 256, kMostBound = 64, kUsualBound = 4;

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
    throw BadInput(fmt::format("error: found {}, expected {}", found, expected));
}

void check_range(const char* option, int value, int high) {
    if (value < 0 || value > high) refuse(fmt::format("{} {}", option, value), fmt::format("0 to {}", high));
}

/// What makes no sense without workers, or without an endpoint that others reach.
void check_together(const WorkerArguments& a) {
    const bool alone = a.workers == 0 && a.listen.empty();
    if (alone && !a.processors.empty())
        refuse("--processors without --workers", "how many of them, such as --workers 10");
    if (alone && (a.mode != "sync" || a.bound.value_or(0) != 0))
        refuse(a.mode != "sync" ? "--mode " + a.mode : fmt::format("--bound {}", *a.bound),
               "--workers N with it: without workers a scene runs in this process");
    if (a.mode == "sync" && a.bound.value_or(0) != 0)
        refuse(fmt::format("--bound {} with --mode sync", *a.bound), "--mode async, or no --bound");
    if (!a.processors.empty() && !a.listen.empty())
        refuse("--listen with --processors", "one of them: simulated processors are in this process");
    if (a.listen.empty() && (!a.keys.empty() || a.expect > 0))
        refuse(!a.keys.empty() ? "--keys" : "--expect",
               "--listen ENDPOINT with it, where workers of other hosts come in");
    if (a.expect > 0 && a.expect < a.workers)
        refuse(fmt::format("--expect {}", a.expect),
               fmt::format("at least the {} --workers that are started here", a.workers));
}

}  // namespace

std::shared_ptr<WorkerArguments> add_worker_options(CLI::App& command) {
    auto a = std::make_shared<WorkerArguments>();
    command
        .add_option("--workers", a->workers,
                    "Worker processes to start here; 0 without --listen: all in this process")
        ->capture_default_str();
    command
        .add_option("--mode", a->mode,
                    "sync: in lockstep, to the bit as in one process; async: boundedly out of step")
        ->capture_default_str();
    command.add_option(
        "--bound", a->bound,
        "async: steps that a worker may be ahead of the slowest, 1 to 64, default 4; 0 is lockstep");
    command.add_option("--balance", a->balance, "on or off: workers trade bodies to be equally fast")
        ->capture_default_str();
    command.add_option("--listen", a->listen,
                       "Endpoint for workers of other hosts, such as tcp://0.0.0.0:5860");
    command.add_option("--keys", a->keys, "Folder made by `musicworld keys`; needed beyond this host");
    command.add_option("--expect", a->expect, "Workers to wait for before the first step");
    command.add_option("--processors", a->processors,
                       "simulated[:latency=S,slowdown=X,cost=measured|modelled]: workers in this process, "
                       "each with a clock of its own");
    return a;
}

sim::SimulatedProcessors parse_processors(const std::string& text) {
    sim::SimulatedProcessors processors;
    const std::size_t colon = text.find(':');
    const std::string wanted =
        "simulated, with latency=SECONDS (to 10), slowdown=TIMES (to 1e6) or "
        "cost=measured|modelled after a colon";
    if (text.substr(0, colon) != "simulated") refuse("--processors " + text, wanted);
    if (colon == std::string::npos) return processors;
    for (const std::string& part : split_at_commas(text.substr(colon + 1))) {
        const std::size_t equals = part.find('=');
        const std::string name = part.substr(0, equals),
                          value = equals == std::string::npos ? "" : part.substr(equals + 1);
        if (name == "cost" && (value == "measured" || value == "modelled"))
            processors.modelled = value == "modelled";
        else if (name == "latency" || name == "slowdown") {
            const double number = parse_number(value, "--processors " + name);
            const bool good = name == "latency" ? number >= 0 && number <= 10 : number > 0 && number <= 1e6;
            if (!good) refuse("--processors " + text, wanted);
            (name == "latency" ? processors.latency_s : processors.slowdown) = number;
        } else
            refuse("--processors " + text, wanted);
    }
    return processors;
}

std::optional<WorkerOptions> worker_options_of(const WorkerArguments& a) {
    check_range("--workers", a.workers, kMostWorkers);
    check_range("--expect", a.expect, kMostWorkers);
    check_range("--bound", a.bound.value_or(0), kMostBound);
    if (a.mode != "sync" && a.mode != "async") refuse("--mode " + a.mode, "sync or async");
    if (a.balance != "on" && a.balance != "off") refuse("--balance " + a.balance, "on or off");
    check_together(a);
    if (a.workers == 0 && a.listen.empty()) return {};
    WorkerOptions o;
    o.count = a.workers;
    o.bound = a.bound.value_or(a.mode == "async" ? kUsualBound : 0);
    o.pace = o.bound > 0 ? sim::Pace::bounded : sim::Pace::lockstep;  // bound 0 is lockstep
    o.balance = a.balance == "on";
    o.listen = a.listen, o.keys = a.keys, o.expect = a.expect;
    if (!a.processors.empty()) {
        o.simulated = parse_processors(a.processors);
        o.simulated->count = a.workers;
    }
    return o;
}

std::string mode_name(sim::Pace pace) {
    return pace == sim::Pace::lockstep ? "sync" : "async";
}

}  // namespace app
