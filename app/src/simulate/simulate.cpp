#include "simulate/simulate.h"

#include <fmt/format.h>
#include <sim/errors.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "files/bad_input.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "simulate/momentum_watch.h"
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

/// Writes what is told of a run, and keeps what the end needs.
class RunObserver : public sim::DistributedObserver {
public:
    RunObserver(const SimulateOptions& options, const Scene& scene, SimulateResult& result)
        : options_(options),
          scene_(scene),
          result_(result),
          record_(options, scene),
          bar_(options.progress),
          last_(last_step(options, scene)) {}

    void at(std::uint64_t step, const sim::World& world) override;
    void ready(std::uint64_t, const sim::World& world) override { record_.take_frames(world); }
    void worked(const sim::WorkerStep& step) override { record_.take_worker(step); }
    void note(const std::string& what) override { result_.notes.push_back(what); }

    void finish(const sim::DistributedResult& run);
    void write(const WallTimer& wall) { record_.finish(result_, wall); }

private:
    void describe(const sim::World& world);

    const SimulateOptions& options_;
    const Scene& scene_;
    SimulateResult& result_;
    SimulateRecord record_;
    ProgressBar bar_;
    std::uint64_t last_;
    std::optional<MomentumWatch> momentum_;
};

void RunObserver::at(std::uint64_t step, const sim::World& world) {
    constexpr std::uint64_t kMomentumEvery =
        10;  // [steps] the sum over all bodies holds up workers' messages
    if (step == 0) {
        record_.start(world);
        momentum_.emplace(scene_, world);
        result_.energy_start = world.energy();
    } else {
        result_.body_steps += std::uint64_t(world.bodies());
        record_.take_step(world);
    }
    // Where rest may end the run any step may be the last.
    const bool perhaps_last = step == last_ || options_.until_rest;
    if (perhaps_last || !options_.workers || step % kMomentumEvery == 0) momentum_->look(world);
    if (perhaps_last) describe(world);
    bar_.show(last_ > 0 ? double(step) / double(last_) : 1);
}

void RunObserver::describe(const sim::World& world) {
    result_.bodies = world.bodies();
    result_.rigid = result_.linear = result_.modal = result_.groups_cut = 0;
    for (int body = 0; body < world.bodies(); ++body) {
        const sim::FidelityChoice choice = world.fidelity(body);
        const sim::Fidelity fidelity = choice.fidelity;
        result_.groups_cut += choice.cut.below < choice.cut.count;
        (fidelity == sim::Fidelity::rigid    ? result_.rigid
         : fidelity == sim::Fidelity::linear ? result_.linear
                                             : result_.modal) += 1;
    }
    result_.time_s = world.time_s();
    result_.energy = world.energy();
    result_.momentum = world.momentum(), result_.angular_momentum = world.angular_momentum();
    result_.state_hash = world.state_hash();
}

void RunObserver::finish(const sim::DistributedResult& run) {
    bar_.clear();
    if (options_.workers) result_.workers = run;
    result_.steps = run.steps;
    result_.elapsed_s = run.elapsed_s, result_.cpu_s = run.cpu_s;
    result_.counts = run.counts;
    result_.rest_reached = run.rest_reached;
    for (const sim::QuarantinedBody& q : run.quarantined)
        result_.quarantined.emplace_back(name_of(scene_, static_cast<std::size_t>(q.body)), q);
    // What a worker that died had counted of the impulse from outside is lost with it.
    if (run.lost == 0 && run.quarantined.empty()) result_.drift = momentum_->drift(run.outside_impulse);
    for (const sim::WorldEvent& event : scene_.events)
        if (!options_.workers && (event.step < run.steps || run.rest_reached))
            for (const sim::Slowing& slowing : event.slowing)
                note(
                    fmt::format("at {} s worker {} is to be slower {} times: not done, as there are no "
                                "workers in one process",
                                double(event.step) * result_.dt_s, slowing.worker, slowing.factor));
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

/// Tells how workers elsewhere join: a line for each of their keys.
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
                           sim::DistributedObserver& observer) {
    const sim::DistributedSettings settings = settings_of(options, scene);
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
    SimulateResult result;
    result.scene = scene.file, result.name = scene.name;
    result.dt_s = scene.world.settings.dt;
    result.rest_wanted = options.until_rest;
    if (options.workers) result.worker_options = *options.workers;
    RunObserver observer(options, scene, result);
    try {
        observer.finish(run(scene, options, observer));
    } catch (const sim::InputError& wrong) {
        if (!wrong.names_place()) throw;
        throw BadInput(
            fmt::format("{}: error: {}", scene.file.string(), wrong.what()));  // no single key shows it
    }
    result.wall_s = wall.seconds();
    observer.write(wall);
    return result;
}

}  // namespace app
