#include "simulate/simulate.h"

#include <fmt/format.h>
#include <sim/errors.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "files/bad_input.h"
#include "process/clock.h"
#include "simulate/simulate_record.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::uint64_t last_step(const SimulateOptions& options, const Scene& scene) {
    constexpr double kLongestRestS = 600;
    if (options.steps) return *options.steps;
    const double seconds = options.seconds.value_or(options.until_rest ? kLongestRestS : scene.seconds);
    return std::uint64_t(std::llround(std::ceil(seconds / scene.world.settings.dt - 1e-6)));
}

sim::DistributedSettings settings_of(const SimulateOptions& options, const Scene& scene) {
    sim::DistributedSettings settings;
    settings.steps = last_step(options, scene);
    settings.until_rest = options.until_rest;
    settings.all_to_first = scene.workers.all_to_first;
    settings.market.from_step = scene.workers.balance_from;
    if (!options.workers) return settings;
    settings.pace = options.workers->pace;
    settings.bound = options.workers->bound;
    settings.market.trade = options.workers->balance;
    return settings;
}

/// Prints how workers elsewhere join: a line for each of their keys.
void print_how_to_join(const std::string& endpoint, const fs::path& keys) {
    std::vector<std::string> options;
    if (!keys.empty())
        for (const fs::directory_entry& entry : fs::directory_iterator(keys))
            if (entry.path().extension() == ".key" && entry.path().stem() != "application")
                options.push_back(" --key " + entry.path().string());
    if (options.empty()) options.emplace_back();
    std::sort(options.begin(), options.end());
    for (const std::string& key : options)
        fmt::print(stderr, "listening: musicworld worker --connect {}{}\n", endpoint, key);
}

sim::DistributedLaunch launch_of(const WorkerOptions& workers) {
    sim::DistributedLaunch launch;
    launch.processes = {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers.count};
    launch.listen = workers.listen;
    launch.expect = workers.expect;
    launch.keys = workers.keys;
    if (!workers.listen.empty())
        launch.listening = [keys = workers.keys](const std::string& endpoint) {
            print_how_to_join(endpoint, keys);
        };
    return launch;
}

sim::DistributedResult run(const Scene& scene, const SimulateOptions& options,
                           const sim::DistributedSettings& settings, sim::DistributedObserver& observer) {
    if (!options.workers) return sim::run_alone(scene, settings, observer);
    if (options.workers->simulated)
        return sim::simulate_processors(scene, settings, *options.workers->simulated, observer);
    return sim::run_distributed(scene, settings, launch_of(*options.workers), observer);
}

void check(const SimulateOptions& options, const Scene& scene) {
    if (options.until_rest && !scene.world.settings.sleeping)
        throw BadInput(fmt::format(
            "{}: error: found sleeping = false, expected true for --until rest; change one of them",
            scene.file.string()));
    if ((options.frames || options.video) && !options.out)
        throw BadInput("error: found --frames or --video without --out, expected a folder for the pictures");
}

}  // namespace

SimulateResult simulate(const SimulateOptions& options) {
    const Scene scene = read_scene(options.scene, options.dt_s);
    check(options, scene);
    const WallTimer wall;
    const sim::DistributedSettings settings = settings_of(options, scene);
    SimulateRecord record(options, scene, settings.steps);
    sim::DistributedResult done;
    try {
        done = run(scene, options, settings, record);
    } catch (const sim::InputError& wrong) {
        if (!wrong.names_place()) throw;
        throw BadInput(
            fmt::format("{}: error: {}", scene.file.string(), wrong.what()));  // no single key shows it
    }
    return record.finish(done, wall);
}

}  // namespace app
