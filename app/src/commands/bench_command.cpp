#include <fmt/format.h>
#include <tracking/input.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "commands/bench_options.h"
#include "commands/command.h"
#include "commands/commands.h"
#include "commands/worker_options.h"
#include "process/child_process.h"

namespace app {
namespace {

/// With the words of this command. Does not return.
void become_bench() {
    const std::string program = program_beside("musicworld_bench").string();
    std::vector<std::string> words = split(tracking::read_bytes("/proc/self/cmdline"), '\0');
    std::vector<char*> pointers = {const_cast<char*>(program.c_str())};
    for (std::size_t i = 2; i + 1 < words.size(); ++i) pointers.push_back(words[i].data());  // after `bench`
    pointers.push_back(nullptr);
    execv(program.c_str(), pointers.data());
    throw std::runtime_error(
        fmt::format("error: cannot start {}: {}; `./run bench`, or cmake --build BUILD --target "
                    "musicworld_bench, builds it",
                    program, std::strerror(errno)));
}

}  // namespace

void add_bench_options(Command& program, BenchOptions& o) {
    std::vector<std::string> names = kBenchNames;
    names.emplace_back("all");
    program.required("NAME", o.name, as::choice(names), "What is measured: " + one_of(names));
    using Counts = std::vector<std::int64_t>;
    const auto counts = as::list_of(as::whole(1, 100000));
    program.option<Counts>(
        "--bodies", counts, "sim, workers: how many, in turn",
        [&o](const Counts& bodies) {
            o.sim.bodies.assign(bodies.begin(), bodies.end());
            o.workers.bodies = o.sim.bodies;
        },
        "25,100,400,1600 of sim, 25,400 of workers, 400,1600 of its threads and processes");
    program.option<Counts>(
        "--workers", counts, "workers: how many, in turn",
        [&o](const Counts& workers) { o.workers.workers.assign(workers.begin(), workers.end()); },
        "1,2,3,5,10");
    program.option("--steps", o.workers.steps, as::whole(1, 1000000), "workers: of each run");
    program.option("--bound", o.workers.bound, as::whole(1, 64, "steps"),
                   "workers: how far one may be ahead");
    program.option(
        "--processors", o.workers.processors, as::processors(),
        "workers: simulated[:latency=S,slowdown=X,cost=measured|modelled], of speedup, stragglers, bound, "
        "migration");
    program.option<std::vector<std::string>>(
        "--only", as::list_of(as::choice(kWorkersBenchParts)), "workers: some parts",
        [&o](const std::vector<std::string>& parts) {
            o.workers.only = {parts.begin(), parts.end()};
        },
        "all");
    auto scenes = as::list_of(as::choice(kHardSceneNames));
    scenes.placeholder = "SCENE,...";  // all names would not fit into a line of the manual page
    program.option<std::vector<std::string>>(
        "--scenes", scenes, fmt::format("hard: some of {}", fmt::join(kHardSceneNames, ", ")),
        [&o](std::vector<std::string> some) { o.hard.scenes = std::move(some); }, "all");
    program.option("--halvings", o.hard.halvings, as::whole(0, 10),
                   "hard: of the step, at most, for peers to be as near as we are");
    program.option<std::int64_t>(
        "--rounds", as::whole(0, 1000),
        "sim, workers: how often each; 0: five, three for 100 bodies, one for more; three of workers",
        [&o](std::int64_t rounds) {
            o.sim.rounds = static_cast<int>(rounds);
            if (rounds > 0) o.workers.rounds = static_cast<int>(rounds);
        },
        "0");
    program.option("--modes", o.sim.modes, as::whole(0, 75), "sim: of each ball; 0: rigid ones");
    program.option("--scene", o.scene, as::text("SCENE"),
                   "sim: balls of a scene, e.g. benchmark25, instead of the piles");
    program.flag("--json", o.json, "Print one JSON document");
    program.option("--out", o.out, as::text("DIR"),
                   "Folder for bench.json and plots; of tradeoff for tradeoff.svg, .csv and .json; of all a "
                   "folder for each");
}

void add_bench_command(Command& program) {
    Command command = program.command(
        "bench", "Measure speed beside peers, and speed against error (the program musicworld_bench)");
    auto o = std::make_shared<BenchOptions>();
    add_bench_options(command, *o);
    command.runs([o] { become_bench(); });
}

}  // namespace app
