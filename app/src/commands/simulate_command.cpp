#include "commands/simulate_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "files/bad_input.h"
#include "files/option_values.h"
#include "simulate/simulate.h"

namespace app {
namespace {

/// The options as typed.
struct Typed {
    std::string scene, dt, seconds, out, video, fps = "30", size = "640x480", until;
    std::optional<std::int64_t> steps;
    std::shared_ptr<WorkerArguments> workers;
    bool frames = false, json = false;
};

SimulateOptions options_of(const Typed& a) {
    SimulateOptions o;
    o.workers = worker_options_of(*a.workers);
    o.scene = find_scene(a.scene);
    if (!a.dt.empty()) {
        o.dt_s = parse_number(a.dt, "--dt");
        if (!(*o.dt_s >= 1e-6 && *o.dt_s <= 0.1))
            throw BadInput(fmt::format("error: found --dt {}, expected 1e-6 to 0.1 s", a.dt));
    }
    if (!a.seconds.empty()) {
        o.seconds = parse_number(a.seconds, "--seconds");
        if (!(*o.seconds > 0 && *o.seconds <= 360000))
            throw BadInput(
                fmt::format("error: found --seconds {}, expected more than 0 to 360000", a.seconds));
    }
    if (a.steps && (*a.steps < 0 || *a.steps > 1'000'000'000))
        throw BadInput(fmt::format("error: found --steps {}, expected 0 to 1000000000", *a.steps));
    if (a.steps) o.steps = static_cast<std::uint64_t>(*a.steps);
    if (!a.until.empty() && a.until != "rest")
        throw BadInput(fmt::format("error: found --until {}, expected rest", a.until));
    o.until_rest = a.until == "rest";
    if (!a.out.empty()) o.out = a.out;
    if (!a.video.empty()) o.video = a.video;
    o.frames = a.frames || o.video.has_value();
    o.fps = parse_number(a.fps, "--fps");
    const Eigen::Vector2i size = parse_size(a.size, "--size");
    o.width = size.x(), o.height = size.y();
    o.progress = true;
    return o;
}

void print_workers(const SimulateResult& r) {
    const sim::DistributedResult& w = *r.workers;
    const WorkerOptions& o = r.worker_options;
    fmt::print(
        "{} {}, {}, {}: {:.1f} bytes a body's step, {} contacts between workers, {} bodies traded\n",
        w.workers,
        o.simulated      ? "simulated processors"
        : w.workers == 1 ? "worker"
                         : "workers",
        mode_name(o.pace), o.pace == sim::Pace::bounded ? fmt::format("bound {}", o.bound) : "lockstep",
        r.body_steps > 0 ? double(w.bytes) / double(r.body_steps) : 0.0, w.cross_contacts, w.migrations);
    if (w.lost + w.left > 0)
        fmt::print("{} workers were lost, {} left; {} bodies went to others\n", w.lost, w.left,
                   w.bodies_reowned);
}

void print(const SimulateResult& r, const SimulateOptions& options) {
    fmt::print(
        "{}: {} bodies ({} rigid, {} linear, {} modal), {} steps of {:.6g} s in {:.2f} s: {:.2f} us a body's "
        "step\n",
        r.name, r.bodies, r.rigid, r.linear, r.modal, r.steps, r.dt_s, r.elapsed_s,
        r.body_steps > 0 ? 1e6 * r.elapsed_s / double(r.body_steps) : 0.0);
    fmt::print("energy {:.6g} J at first, {:.6g} J at last; ", r.energy_start.total(), r.energy.total());
    if (!r.workers) fmt::print("{} asleep; ", r.counts.asleep);
    fmt::print("state {:016x}\n", r.state_hash);
    if (r.workers) print_workers(r);
    if (r.counts.constraints_broken > 0) fmt::print("{} constraints broke\n", r.counts.constraints_broken);
    for (const auto& [name, q] : r.quarantined)
        fmt::print("body {} was taken out at step {}: {}\n", name, q.step, q.what);
    if (options.out && r.frames > 0) fmt::print("See {}\n", (*options.out / "frames").string());
}

int run(const Typed& a) {
    const SimulateOptions options = options_of(a);
    const SimulateResult result = simulate(options);
    for (const std::string& note : result.workers ? std::vector<std::string>{} : result.notes)
        fmt::print(stderr, "{}: note: {}\n", result.scene.string(), note);
    if (a.json)
        fmt::print("{}", format_simulate(result));
    else
        print(result, options);
    if (!options.until_rest || result.rest_reached) return 0;
    const std::string awake =
        result.workers ? "bodies"
                       : fmt::format("{} of {} bodies", result.bodies - result.counts.asleep, result.bodies);
    fmt::print(
        stderr,
        "{}: error: found {} awake after {} steps (or events to come), expected rest; allow more --steps, or "
        "damp what swings and spins (damping_alpha)\n",
        result.scene.string(), awake, result.steps);
    return 1;
}

}  // namespace

void add_simulate_command(CLI::App& program, int& status) {
    CLI::App* command = program.add_subcommand("simulate", "Let the bodies of a scene fall, touch and bend");
    auto a = std::make_shared<Typed>();
    command->add_option("SCENE", a->scene, "Scene: a file, or the name of a bundled one")->required();
    command->add_option("--steps", a->steps, "Steps to do; default: as long as the scene says");
    command->add_option("--seconds", a->seconds, "Instead of --steps, of the scene's time")
        ->excludes("--steps");
    command->add_option("--dt", a->dt, "Length of a step [s], such as 1/60; default: the scene's");
    command->add_option("--until", a->until,
                        "rest: until every body sleeps and no event is left, --steps (10 minutes) at most");
    command->add_option(
        "--out", a->out,
        "Folder for states.csv, energy.csv, times.csv, summary.json; with workers timing.csv, workers.svg");
    command->add_flag("--frames", a->frames, "Also draw frames/000000.png on");
    command->add_option("--fps", a->fps, "Frames a second, and rows of states.csv")->capture_default_str();
    command->add_option("--size", a->size, "Size of the frames")->capture_default_str();
    command->add_option("--video", a->video, "Also make a video (MP4) of the frames");
    a->workers = add_worker_options(*command);
    command->add_flag("--json", a->json, "Print one JSON document instead of words");
    command->callback([a, &status] { status = run(*a); });
}

}  // namespace app
