#include "simulate/simulate.h"

#include <fmt/format.h>
#include <sim/errors.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "files/bad_input.h"
#include "files/checksum.h"
#include "files/output_folder.h"
#include "pictures/frame_thread.h"
#include "process/clock.h"
#include "process/parallel.h"
#include "process/progress_bar.h"
#include "process/standard_streams.h"
#include "report/json_document.h"
#include "report/table.h"
#include "scene/scene.h"
#include "simulate/checkpoint.h"
#include "simulate/simulate_record.h"
#include "statistics/statistics.h"

namespace app {
namespace {

namespace fs = std::filesystem;

/// Of the scene's own dt.
std::uint64_t last_step(const SimulateOptions& options, const Scene& scene) {
    constexpr double kLongestRestS = 600;
    if (options.steps) return *options.steps;
    const double seconds = options.seconds.value_or(options.until_rest ? kLongestRestS : scene.seconds);
    return std::uint64_t(std::llround(std::ceil(seconds / scene.world.settings.dt - 1e-6)));
}

sim::DistributedSettings settings_of(const SimulateOptions& options, const Scene& scene,
                                     std::uint64_t steps) {
    sim::DistributedSettings settings;
    settings.steps = steps;
    settings.until_rest = options.until_rest;
    settings.all_to_first = scene.workers.all_to_first;
    settings.market.from_step = scene.workers.balance_from;
    if (!options.workers) return settings;
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
    std::string there = endpoint;
    for (const std::string_view all : {"tcp://0.0.0.0:", "tcp://*:", "tcp://[::]:"})
        if (endpoint.starts_with(all)) there = fmt::format("tcp://HOST:{}", endpoint.substr(all.size()));
    for (const std::string& key : options)
        tell(fmt::format("listening: musicworld worker --connect {}{}", there, key));
}

sim::DistributedLaunch launch_of(const WorkerOptions& workers, int threads) {
    sim::DistributedLaunch launch;
    launch.processes = {fs::read_symlink("/proc/self/exe").string(),
                        {"worker", "--threads", std::to_string(threads)},
                        workers.count};
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
                           const sim::DistributedSettings& settings, sim::DistributedObserver& observer,
                           const sim::RunState* from) {
    if (!options.workers)
        return sim::run_alone(scene, settings, observer, from,
                              options.threads.value_or(int(worthwhile_threads())));
    if (options.workers->simulated)
        return sim_bench::simulate_processors(scene, settings, *options.workers->simulated, observer);
    return sim::run_distributed(scene, settings, launch_of(*options.workers, options.threads.value_or(1)),
                                observer);
}

/// Changes what is left to a scene's accuracy.
KeptAccuracy keep(double accuracy, const SimulateOptions& options, std::uint64_t steps, Scene& scene) {
    ProgressBar bar(options.progress);
    KeptAccuracy kept;
    kept.report = sim::keep_accuracy(scene, {accuracy, steps, options.until_rest, options.dt_s.has_value()},
                                     [&](double share) { bar.show(share); });
    bar.clear();
    for (std::size_t b = 0; b < kept.report.bodies.size(); ++b)
        kept.names.push_back(name_of(scene, static_cast<int>(b)));
    return kept;
}

void check(const SimulateOptions& options, const Scene& scene) {
    if (options.threads && options.workers && options.workers->simulated)
        throw BadInput(
            fmt::format("error: found --threads {} with --processors, expected one of both: each simulated "
                        "processor has one thread",
                        *options.threads));
    if (options.threads && options.workers && options.workers->count == 0)
        throw BadInput(
            fmt::format("error: found --threads {} without a worker process that is started here, expected "
                        "--workers N; whoever starts others tells them: musicworld worker --threads {}",
                        *options.threads, *options.threads));
    if (options.until_rest && !scene.world.settings.sleeping)
        throw BadInput(fmt::format(
            "{}: error: found sleeping = false, expected true for --until rest; change one of them",
            scene.file.string()));
    if ((options.frames || options.video) && !options.out)
        throw BadInput("error: found --frames or --video without --out, expected a folder for the pictures");
    if (options.checkpoint > 0 && !options.out)
        throw BadInput("error: found --checkpoint without --out, expected a folder to save it in");
    if ((options.checkpoint > 0 || options.goes_on) && options.workers)
        throw BadInput(
            "error: found --checkpoint with workers, expected --workers 0: what depends on who was faster "
            "cannot go on as it was");
    if (options.video) {
        const OutputFile can_be(*options.video);
        if (options.width % 2 != 0 || options.height % 2 != 0)
            throw BadInput(fmt::format("error: found --video with --size {}x{}, expected even sides",
                                       options.width, options.height));
        require_ffmpeg();
    }
    if (options.workers && options.out) require_gnuplot();
}

/// What a run's checkpoints say of it.
Checkpoint about(const SimulateOptions& options, const Scene& scene) {
    return {options.words,
            fs::current_path(),
            MUSICWORLD_VERSION,
            program_build(),
            sha256_of_file(scene.file),
            {},
            {}};
}

/// Of the run in `options.out`, whose scene and program must be those of `run`.
void take_saved(const SimulateOptions& options, Checkpoint& run) {
    const fs::path file = checkpoint_file(*options.out);
    Checkpoint saved = read_checkpoint(file);
    const auto expect = [&](const std::string& what, const std::string& found, const std::string& expected) {
        if (found != expected)
            throw BadInput(fmt::format("{}: error: found a run of {} {}, expected {}; begin it anew",
                                       file.string(), what, one_line(found), expected));
    };
    expect("version", saved.version, run.version);
    expect("build and processor", saved.build, run.build);
    expect("a scene with SHA-256", saved.scene_sha256, run.scene_sha256);
    run.record = std::move(saved.record);
    run.state = std::move(saved.state);
}

sim::RunState state_of(const Checkpoint& saved, const SimulateOptions& options, const Scene& scene,
                       std::uint64_t steps) {
    const std::string file = checkpoint_file(*options.out).string();
    try {
        sim::RunState state = sim::decode_run_state(saved.state, scene);
        if (state.result.steps <= steps) return state;
        throw BadInput(fmt::format("{}: error: found step {}, expected at most {}; begin the run anew", file,
                                   state.result.steps, steps));
    } catch (const sim::InputError& wrong) {
        throw BadInput(fmt::format("{}: error: {}; begin the run anew", file, wrong.what()));
    }
}

using Json = nlohmann::ordered_json;

Json json_of(const Eigen::Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}

Json json_of(const std::vector<Mishap>& mishaps, const char* of) {
    Json all = Json::array();
    for (const Mishap& m : mishaps) all.push_back({{of, m.name}, {"step", m.step}});
    return all;
}

/// What is left out of the first part of the summary.
Json details_of(const SimulateResult& r) {
    std::vector<std::string> notes = r.notes;
    for (std::string& line : r.mishaps.lines()) notes.push_back(std::move(line));
    if (r.accuracy && !r.accuracy->is_kept())
        for (std::string& line : r.accuracy->lines()) notes.push_back(std::move(line));
    Json quarantined = Json::array();
    for (const Mishap& m : r.mishaps.quarantined)
        quarantined.push_back({{"body", m.name}, {"step", m.step}, {"what", m.what}});
    const sim::World::Energy& e = r.energy;
    const sim::WorldCounts& n = r.counts;
    const MomentumDrift drift = r.drift.value_or(MomentumDrift{kNoValue, {}, 0});
    Json details = {
        {"name", r.name},
        {"time_s", r.time_s},
        {"fidelity",
         {{"rigid", r.rigid}, {"linear", r.linear}, {"modal", r.modal}, {"groups_cut", r.groups_cut}}},
        {"accuracy", r.accuracy ? r.accuracy->json() : Json()},
        {"energy_start_j", r.energy_start.total()},
        {"energy_parts_j",
         {{"kinetic", e.kinetic},
          {"potential", e.potential},
          {"elastic", e.elastic},
          {"springs", e.springs}}},
        {"momentum_kg_m_s", json_of(r.momentum)},
        {"angular_momentum_kg_m2_s", json_of(r.angular_momentum)},
        {"momentum_drift_kg_m_s", Cell(drift.linear).json()},
        {"angular_momentum_drift_kg_m2_s", Cell(drift.angular).json()},
        {"counts",
         {{"contacts", n.contacts},
          {"pairs", n.pairs},
          {"islands", n.islands},
          {"asleep", n.asleep},
          {"inverse_fallbacks", n.inverse_fallbacks},
          {"deformations_limited", n.deformations_limited},
          {"constraints_broken", n.constraints_broken}}},
        {"quarantined", quarantined},
        {"constraints_broken", json_of(r.mishaps.broken, "constraint")},
        {"held_at_limit", json_of(r.mishaps.limited, "body")},
        {"spun", json_of(r.mishaps.spun, "body")},
        {"at_rest", r.rest_reached},
        {"frames", r.frames},
        {"notes", notes},
        {"wall_s", r.wall_s},
        {"versions", {{"musicworld", MUSICWORLD_VERSION}}}};
    if (r.worker_options) details["counts"] = Json();  // workers do not send theirs
    return details;
}

/// Which clock elapsed_s is of.
std::string clock_of(const WorkerOptions& options) {
    if (!options.simulated) return "wall";
    return fmt::format("simulated processors, {} costs, {} times slower, {} s from worker to worker",
                       options.simulated->modelled ? "modelled" : "measured", options.simulated->slowdown,
                       options.simulated->latency_s);
}

Json workers_of(const SimulateResult& r) {
    return {{"clock", clock_of(*r.worker_options)},
            {"balance", r.worker_options->balance},
            {"workers_lost", r.lost},
            {"workers_left", r.left},
            {"bodies_reowned", r.bodies_reowned},
            {"trades", r.trades},
            {"one_owner", r.one_owner},
            {"bytes_per_body_step", r.body_steps > 0 ? Json(double(r.bytes) / double(r.body_steps)) : Json()},
            {"largest_lead", r.largest_lead},
            {"largest_ghost_age", r.largest_ghost_age},
            {"refused_messages", r.refused_messages}};
}

}  // namespace

SimulateResult simulate(const SimulateOptions& options) {
    Scene scene = read_scene(options.scene, options.dt_s);
    check(options, scene);
    std::unique_ptr<OutputFolder> folder;
    if (options.out)
        folder = std::make_unique<OutputFolder>(*options.out, kSimulateProducts, options.goes_on);
    Checkpoint kept;
    if (options.checkpoint > 0 || options.goes_on) kept = about(options, scene);
    if (options.goes_on) take_saved(options, kept);
    const WallTimer wall;
    try {
        std::uint64_t steps = last_step(options, scene);
        std::optional<KeptAccuracy> accuracy;
        if (const std::optional<double> asked = options.accuracy ? options.accuracy : scene.accuracy) {
            accuracy = keep(*asked, options, steps, scene);
            steps *= std::uint64_t(accuracy->report.step_parts);
            scene.workers.balance_from *= std::uint64_t(accuracy->report.step_parts);
        }
        const sim::DistributedSettings settings = settings_of(options, scene, steps);
        std::optional<sim::RunState> from;
        if (options.goes_on) from = state_of(kept, options, scene, steps);
        SimulateRecord record(options, scene, steps, std::move(folder), std::move(kept));
        const sim::DistributedResult done = run(scene, options, settings, record, from ? &*from : nullptr);
        return record.finish(done, wall, std::move(accuracy));
    } catch (const sim::InputError& wrong) {
        if (!wrong.names_place()) throw;
        throw BadInput(
            fmt::format("{}: error: {}", scene.file.string(), wrong.what()));  // no single key shows it
    }
}

std::string format_simulate(const SimulateResult& r) {
    Json json = {
        {"scene", r.scene.string()},
        {"bodies", r.bodies},
        {"steps", r.steps},
        {"dt_s", r.dt_s},
        {"workers", r.workers},
        {"bound", r.worker_options ? r.worker_options->bound : 0},
        {"elapsed_s", r.elapsed_s},
        {"cpu_s", r.cpu_s},
        {"ns_per_body_step", r.body_steps > 0 ? Json(1e9 * r.elapsed_s / double(r.body_steps)) : Json()},
        {"bytes_per_body_update", r.records > 0 ? double(r.bytes_states) / double(r.records) : 0.0},
        {"cross_worker_contacts", r.cross_contacts},
        {"migrations", r.migrations},
        {"bodies_lost", r.mishaps.quarantined.size()},
        {"state_hash", fmt::format("{:016x}", r.state_hash)},
        {"momentum_drift", r.drift ? Json(r.drift->share()) : Json()},
        {"energy_j", r.energy.total()}};
    json.update(details_of(r));
    if (r.worker_options) json.update(workers_of(r));
    return json_document(json);
}

}  // namespace app
