#include "simulate/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <stdexcept>

#include "files/bad_input.h"
#include "play/play_setup.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "simulate/simulate_record.h"
#include "simulate/simulate_run.h"

namespace app {
namespace {

class Run {
public:
    Run(const SimulateOptions& options, const Scene& scene)
        : options_(options), scene_(scene), world_(scene.world) {
        result_ = result_at_start(options, scene);
        result_.energy_start = world_.energy();
    }
    SimulateResult run();

private:
    [[nodiscard]] bool at_rest() const { return next_event_ == scene_.events.size() && world_.all_asleep(); }
    void play_events();
    double step();

    const SimulateOptions& options_;
    const Scene& scene_;
    sim::World world_;
    std::size_t next_event_ = 0;
    SimulateResult result_;
};

void Run::play_events() {
    for (; next_event_ < scene_.events.size() && scene_.events[next_event_].step <= result_.steps;
         ++next_event_) {
        const sim::WorldEvent& event = scene_.events[next_event_];
        for (const int constraint : event.removed)
            if (world_.constraint_holds(constraint)) world_.remove_constraint(constraint);
        for (std::size_t k = event.first; k < event.end; ++k) (void)world_.add_body(scene_.later[k]);
        for (const sim::Slowing& slowing : event.slowing)
            result_.notes.push_back(
                fmt::format("at {} s worker {} is to be slower {} times: not done, as there are no workers "
                            "in one process",
                            double(event.step) * result_.dt_s, slowing.worker, slowing.factor));
    }
}

double Run::step() {
    const WallTimer wall;
    const double cpu = thread_cpu_s();
    world_.step();
    const double elapsed = wall.seconds();
    result_.elapsed_s += elapsed;
    result_.cpu_s += thread_cpu_s() - cpu;
    ++result_.steps;
    result_.body_steps += std::uint64_t(world_.bodies());
    return elapsed;
}

SimulateResult Run::run() {
    const WallTimer wall;
    SimulateRecord record(options_, scene_);
    record.start(world_);
    MomentumWatch drift(scene_, world_);
    ProgressBar bar(options_.progress);
    const std::uint64_t last = last_step(options_, scene_);
    while (result_.steps < last) {
        play_events();
        if (options_.until_rest && at_rest()) break;
        record.take_frames(world_);
        record.take_time(result_.steps + 1, step());
        record.take_step(world_);
        drift.look(world_);
        bar.show(double(result_.steps) / double(last));
    }
    record.take_frames(world_);
    bar.clear();
    if (world_.quarantined().empty()) result_.drift = drift.drift(world_.outside_impulse());
    describe_end(world_, result_);
    result_.counts = world_.counts();
    result_.rest_reached = at_rest();
    for (const sim::QuarantinedBody& q : world_.quarantined())
        result_.quarantined.emplace_back(world_.definition(q.body).name, q);
    result_.wall_s = wall.seconds();
    record.finish(result_, wall);
    return result_;
}

void check(const SimulateOptions& options, const Scene& scene) {
    if (options.until_rest && !scene.world.settings.sleeping)
        throw BadInput(fmt::format(
            "{}: error: found sleeping = false, expected true for --until rest; change one of them",
            scene.file.string()));
    if ((options.frames || options.video) && !options.out)
        throw BadInput("error: found --frames or --video without --out, expected a folder for the pictures");
    if (options.frames) {
        const bool size =
            options.width >= 16 && options.height >= 16 && options.width <= 8192 && options.height <= 8192;
        if (!size)
            throw BadInput(fmt::format("error: found --size {}x{}, expected 16x16 to 8192x8192",
                                       options.width, options.height));
    }
    if (!(options.fps >= 0.1 && options.fps <= 1000))
        throw BadInput(fmt::format("error: found --fps {}, expected 0.1 to 1000", options.fps));
}

}  // namespace

SimulateResult result_at_start(const SimulateOptions& options, const Scene& scene) {
    SimulateResult result;
    result.scene = scene.file, result.name = scene.name;
    result.dt_s = scene.world.settings.dt;
    result.rest_wanted = options.until_rest;
    return result;
}

std::uint64_t last_step(const SimulateOptions& options, const Scene& scene) {
    constexpr double kLongestRestS = 600;
    if (options.steps) return *options.steps;
    const double seconds = options.seconds.value_or(options.until_rest ? kLongestRestS : scene.seconds);
    return std::uint64_t(std::llround(std::ceil(seconds / scene.world.settings.dt - 1e-6)));
}

void describe_end(const sim::World& world, SimulateResult& result) {
    result.bodies = world.bodies();
    for (int body = 0; body < world.bodies(); ++body) {
        const sim::FidelityChoice choice = world.fidelity(body);
        const sim::Fidelity fidelity = choice.fidelity;
        result.groups_cut += choice.cut.below < choice.cut.count;
        (fidelity == sim::Fidelity::rigid    ? result.rigid
         : fidelity == sim::Fidelity::linear ? result.linear
                                             : result.modal) += 1;
    }
    result.time_s = world.time_s();
    result.energy = world.energy();
    result.momentum = world.momentum(), result.angular_momentum = world.angular_momentum();
    result.state_hash = world.state_hash();
}

SimulateResult simulate(const SimulateOptions& options) {
    const Scene scene = read_scene(options.scene, options.dt_s);
    check(options, scene);
    if (options.workers) return simulate_with_workers(options, scene);
    std::unique_ptr<Run> run;
    try {
        run = std::make_unique<Run>(options, scene);
    } catch (const std::invalid_argument& wrong) {  // what no single key shows
        throw BadInput(fmt::format("{}: error: {}", scene.file.string(), wrong.what()));
    }
    return run->run();
}

}  // namespace app
