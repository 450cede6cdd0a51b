#include "commands/worker_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace app {
namespace {

constexpr int kMostWorkers = 256, kMostBound = 64, kUsualBound = 4;

/// What WorkerOptions are made of.
struct TypedWorkers {
    WorkerOptions options;
    bool async = false;
    std::optional<int> bound;
};

/// What makes no sense without workers, or without an endpoint that others reach.
void check_together(const TypedWorkers& typed) {
    const WorkerOptions& o = typed.options;
    const bool alone = o.count == 0 && o.listen.empty();
    const int bound = typed.bound.value_or(0);
    if (alone && o.simulated)
        refuse_options("--processors without --workers", "how many of them, such as --workers 10");
    if (alone && (typed.async || bound != 0))
        refuse_options(typed.async ? "--mode async" : fmt::format("--bound {}", bound),
                       "--workers N with it: without workers a scene runs in this process");
    if (!typed.async && bound != 0)
        refuse_options(fmt::format("--bound {} with --mode sync", bound), "--mode async, or no --bound");
    if (o.simulated && !o.listen.empty())
        refuse_options("--listen with --processors", "one of them: simulated processors are in this process");
    if (o.verify > 1 && (typed.async || o.simulated))
        refuse_options(
            fmt::format("--verify {} with {}", o.verify, typed.async ? "--mode async" : "--processors"),
            "--mode sync and processes: only what is to the bit can be compared");
    if (o.verify > std::max({o.count, o.expect, 1}))
        refuse_options(fmt::format("--verify {}", o.verify),
                       "at least as many --workers, or more to --expect: they check each other");
    if (o.listen.empty() && (!o.keys.empty() || o.expect > 0))
        refuse_options(!o.keys.empty() ? "--keys" : "--expect",
                       "--listen ENDPOINT with it, where workers of other hosts come in");
    if (o.expect > 0 && o.expect < o.count)
        refuse_options(fmt::format("--expect {}", o.expect),
                       fmt::format("at least the {} --workers that are started here", o.count));
}

std::optional<WorkerOptions> worker_options_of(const TypedWorkers& typed) {
    check_together(typed);
    WorkerOptions o = typed.options;
    if (o.count == 0 && o.listen.empty()) return {};
    o.bound = typed.bound.value_or(typed.async ? kUsualBound : 0);
    o.pace = o.bound > 0 ? sim::Pace::bounded : sim::Pace::lockstep;  // bound 0 is lockstep
    if (o.simulated) o.simulated->count = o.count;
    return o;
}

std::optional<sim::SimulatedProcessors> read_processors(const std::string& text) {
    const std::size_t colon = text.find(':');
    if (text.substr(0, colon) != "simulated") return std::nullopt;
    sim::SimulatedProcessors processors;
    if (colon == std::string::npos) return processors;
    for (const std::string& part : split(text.substr(colon + 1))) {
        const auto pair = as::named("NAME=VALUE").read(part);
        if (!pair) return std::nullopt;
        const auto& [name, value] = *pair;
        if (name == "cost" && (value == "measured" || value == "modelled")) {
            processors.modelled = value == "modelled";
            continue;
        }
        const bool latency = name == "latency";
        if (!latency && name != "slowdown") return std::nullopt;
        const auto number = (latency ? as::number(0, 10, "s") : as::number_above(0, 1e6)).read(value);
        if (!number) return std::nullopt;
        (latency ? processors.latency_s : processors.slowdown) = *number;
    }
    return processors;
}

}  // namespace

ValueFormat<sim::SimulatedProcessors> as::processors() {
    return {
        "PROCESSORS",
        "",
        "simulated, with latency=SECONDS (to 10), slowdown=TIMES (to 1e6) or cost=measured|modelled after a "
        "colon",
        read_processors,
        {}};
}

void add_worker_options(Command& command, std::optional<WorkerOptions>& options) {
    auto typed = std::make_shared<TypedWorkers>();
    WorkerOptions& o = typed->options;
    command.option("--workers", o.count, as::whole(0, kMostWorkers),
                   "Worker processes to start here; 0 without --listen: all in this process");
    command.option("--mode", typed->async, as::choice<bool>({{"sync", false}, {"async", true}}),
                   "sync: in lockstep, to the bit as in one process; async: boundedly out of step");
    command.option("--bound", typed->bound, as::whole(0, kMostBound, "steps"),
                   "async: how far a worker may be ahead of the slowest, default 4; 0 is lockstep");
    command.option("--balance", o.balance, as::choice<bool>({{"on", true}, {"off", false}}),
                   "on: workers trade columns of bodies to be equally fast");
    command.option("--listen", o.listen, as::text("ENDPOINT"),
                   "Endpoint for workers of other hosts, such as tcp://0.0.0.0:5860");
    command.option("--keys", o.keys, as::text("DIR"),
                   "Folder made by `musicworld keys`; needed beyond this host");
    command.option("--expect", o.expect, as::whole(0, kMostWorkers),
                   "Workers to wait for before the first step");
    command.option(
        "--verify", o.verify, as::whole(1, kMostWorkers),
        "sync: so many workers compute the same bodies, and one that differs from most is given up");
    command.option(
        "--processors", o.simulated, as::processors(),
        "simulated[:latency=S,slowdown=X,cost=measured|modelled]: workers in this process, each with "
        "a clock of its own");
    command.checks([typed, &options] { options = worker_options_of(*typed); });
}

}  // namespace app
