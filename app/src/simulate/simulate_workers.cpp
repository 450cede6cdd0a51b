#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "files/bad_input.h"
#include "play/play_setup.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "simulate/simulate_record.h"
#include "simulate/simulate_run.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kMomentumEvery = 10;  // [steps] the sum over all bodies holds up the messages

sim::DistributedSettings settings_of(const SimulateOptions& options, const Scene& scene) {
    const WorkerOptions& workers = *options.workers;
    sim::DistributedSettings settings;
    settings.pace = workers.pace;
    settings.bound = workers.bound;
    settings.steps = last_step(options, scene);
    settings.until_rest = options.until_rest;
    settings.all_to_first = scene.workers.all_to_first;
    settings.market.trade = workers.balance;
    settings.market.from_step = scene.workers.balance_from;
    return settings;
}

sim::DistributedLaunch launch_of(const WorkerOptions& workers) {
    sim::DistributedLaunch launch;
    launch.processes = {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers.count};
    launch.listen = workers.listen;
    launch.expect = workers.expect;
    launch.keys = workers.keys;
    if (!workers.listen.empty())
        launch.listening = [](const std::string& endpoint) {
            fmt::print(stderr, "listening: musicworld worker --connect {}\n", endpoint);
        };
    return launch;
}

/// Writes what is told, and keeps what the end needs.
class RunObserver : public sim::DistributedObserver {
public:
    RunObserver(const SimulateOptions& options, const Scene& scene, SimulateResult& result)
        : scene_(scene),
          result_(result),
          record_(options, scene),
          bar_(options.progress),
          last_(last_step(options, scene)) {}

    void at(std::uint64_t step, const sim::World& world) override {
        if (step == 0) {
            record_.start(world);
            watch_ = std::make_unique<MomentumWatch>(scene_, world);
            result_.energy_start = world.energy();
        } else {
            result_.body_steps += std::uint64_t(world.bodies());
            record_.take_step(world);
        }
        record_.take_frames(world);
        if (step % kMomentumEvery == 0 || step == last_ || result_.rest_wanted) watch_->look(world);
        bar_.show(last_ > 0 ? double(step) / double(last_) : 1);
        // Where rest may end the run any step may be the last.
        if (step == last_ || result_.rest_wanted) describe(world);
    }
    void worked(const sim::WorkerStep& step) override { record_.take_worker(step); }
    void note(const std::string& what) override { result_.notes.push_back(what); }

    void finish(const sim::DistributedResult& run);
    void write(const WallTimer& wall) { record_.finish(result_, wall); }

private:
    void describe(const sim::World& world);

    const Scene& scene_;
    SimulateResult& result_;
    SimulateRecord record_;
    ProgressBar bar_;
    std::uint64_t last_;
    std::unique_ptr<MomentumWatch> watch_;
};

void RunObserver::describe(const sim::World& world) {
    result_.rigid = result_.linear = result_.modal = result_.groups_cut = 0;
    describe_end(world, result_);
}

void RunObserver::finish(const sim::DistributedResult& run) {
    bar_.clear();
    result_.workers = run;
    result_.steps = run.steps;
    result_.elapsed_s = run.elapsed_s, result_.cpu_s = run.cpu_s;
    result_.counts = run.counts;
    result_.rest_reached = run.rest_reached;
    for (const sim::QuarantinedBody& q : run.quarantined)
        result_.quarantined.emplace_back(name_of(scene_, static_cast<std::size_t>(q.body)), q);
    // What a worker that died had counted of the impulse from outside is lost with it.
    if (run.lost == 0 && run.quarantined.empty()) result_.drift = watch_->drift(run.outside_impulse);
}

sim::DistributedResult run_workers(const Scene& scene, const SimulateOptions& options,
                                   RunObserver& observer) {
    const WorkerOptions& workers = *options.workers;
    const sim::DistributedSettings settings = settings_of(options, scene);
    if (workers.simulated) return sim::simulate_processors(scene, settings, *workers.simulated, observer);
    return sim::run_distributed(scene, settings, launch_of(workers), observer);
}

}  // namespace

SimulateResult simulate_with_workers(const SimulateOptions& options, const Scene& scene) {
    const WallTimer wall;
    SimulateResult result = result_at_start(options, scene);
    result.worker_options = *options.workers;
    RunObserver observer(options, scene, result);
    try {
        observer.finish(run_workers(scene, options, observer));
    } catch (const std::invalid_argument& wrong) {
        const std::string_view what = wrong.what();
        throw BadInput(
            fmt::format("{}: {}{}", scene.file.string(), what.starts_with("error: ") ? "" : "error: ", what));
    }
    result.wall_s = wall.seconds();
    observer.write(wall);
    return result;
}

}  // namespace app
