#include "commands/worker_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace app {
namespace {

constexpr int kMostWorkers = 256, kMostBound = 64;

/// What WorkerOptions are made of.
struct TypedWorkers {
    WorkerOptions options;
    std::optional<int> bound;
};

/// What makes no sense without workers, or without an endpoint that others reach.
void check_together(const TypedWorkers& typed) {
    const WorkerOptions& o = typed.options;
    const bool alone = o.count == 0 && o.listen.empty();
    if (alone && o.simulated)
        refuse_options("--processors without --workers", "how many of them, such as --workers 10");
    if (alone && typed.bound)
        refuse_options(fmt::format("--bound {}", *typed.bound),
                       "--workers N with it: without workers a scene runs in this process");
    if (o.simulated && !o.listen.empty())
        refuse_options("--listen with --processors", "one of them: simulated processors are in this process");
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
    o.bound = typed.bound.value_or(o.bound);
    if (o.simulated) o.simulated->count = o.count;
    return o;
}

std::optional<sim_bench::SimulatedProcessors> read_processors(const std::string& text) {
    const std::size_t colon = text.find(':');
    if (text.substr(0, colon) != "simulated") return std::nullopt;
    sim_bench::SimulatedProcessors processors;
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

ValueFormat<sim_bench::SimulatedProcessors> as::processors() {
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
    command.option("--bound", typed->bound, as::whole(0, kMostBound, "steps"),
                   "How far a worker may be ahead of the slowest, default 4; 0: a barrier after each step");
    command.option("--balance", o.balance, as::choice<bool>({{"on", true}, {"off", false}}),
                   "on: workers trade columns of bodies to be equally fast");
    command.option("--listen", o.listen, as::text("ENDPOINT"),
                   "Endpoint for workers of other hosts, such as tcp://0.0.0.0:5860");
    command.option("--keys", o.keys, as::text("DIR"),
                   "Folder made by `musicworld keys`; needed beyond this host");
    command.option("--expect", o.expect, as::whole(0, kMostWorkers),
                   "Workers to wait for before the first step");
    command.option(
        "--processors", o.simulated, as::processors(),
        "simulated[:latency=S,slowdown=X,cost=measured|modelled]: workers in this process, each with "
        "a clock of its own");
    command.checks([typed, &options] { options = worker_options_of(*typed); });
}

}  // namespace app
