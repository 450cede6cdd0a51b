#include "simulate/simulate.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sim/errors.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "files/bad_input.h"
#include "files/output_folder.h"
#include "pictures/frame_thread.h"
#include "pictures/scene_stage.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "process/standard_streams.h"
#include "report/json_document.h"
#include "report/table.h"
#include "scene/scene.h"
#include "simulate/run_measures.h"
#include "statistics/statistics.h"

namespace app {
namespace {

namespace fs = std::filesystem;

// The header of each table. states.csv: a body per row at each frame's time; `modes`: its modal coordinates,
// separated by blanks. energy.csv: the world before the first step and after each. times.csv: what each step
// took. timing.csv: each step of each worker, in the order in which they ended.
constexpr const char* kStates = "frame,t_s,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,lx,ly,lz,modes\n";
constexpr const char* kEnergy =
    "step,t_s,kinetic_j,potential_j,elastic_j,springs_j,px,py,pz,lx,ly,lz,contacts,pairs,islands,asleep\n";
constexpr const char* kTimes = "step,elapsed_s\n";
constexpr const char* kTiming =
    "worker,step,seconds,smoothed_s,waited_s,bodies,lead,ghost_age,bytes,cross_contacts\n";

const std::string& name_of(const Scene& scene, int body) {
    const auto b = static_cast<std::size_t>(body), now = scene.world.bodies.size();
    return b < now ? scene.world.bodies[b].name : scene.later[b - now].name;
}

std::string state_row(const Scene& scene, const sim::World& world, int body, std::size_t frame) {
    const sim::WorldBodyState s = world.state(body);
    const Eigen::Vector3d &p = s.position, &v = s.velocity, &l = s.angular_momentum;
    const Eigen::Quaterniond& q = s.orientation;
    return csv_line({frame, world.time_s(), name_of(scene, body), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(),
                     q.z(), v.x(), v.y(), v.z(), l.x(), l.y(), l.z(),
                     fmt::format("{}", fmt::join(s.q.begin(), s.q.end(), " "))});
}

/// `stepped`: in this process, so that the world knows its contacts; else their cells are empty.
std::string energy_row(const sim::World& world, bool stepped) {
    const sim::World::Energy e = world.energy();
    const Eigen::Vector3d p = world.momentum(), l = world.angular_momentum();
    const sim::WorldCounts& n = world.counts();
    const auto found = [&](const auto& count) { return stepped ? Cell(count) : Cell(); };
    return csv_line({n.steps, world.time_s(), e.kinetic, e.potential, e.elastic, e.springs, p.x(), p.y(),
                     p.z(), l.x(), l.y(), l.z(), found(n.contacts), found(n.pairs), found(n.islands),
                     found(n.asleep)});
}

/// A CSV file that grows while a simulation runs. Throws std::runtime_error when it cannot be written.
class GrowingTable {
public:
    GrowingTable(const fs::path& file, const std::string& header)
        : file_(file), out_(open_file(file, O_WRONLY | O_CREAT | O_TRUNC)), rows_(header) {
        check(bool(out_));
    }
    void add(const std::string& rows) {
        constexpr std::size_t kBlock = 65536;
        rows_ += rows;
        if (rows_.size() >= kBlock) write();
    }
    void finish() {
        write();
        check(out_.close());
    }

private:
    void write() {
        check(out_.write(rows_));
        rows_.clear();
    }
    void check(bool done) const {
        if (!done)
            throw std::runtime_error("error: " + cannot("write " + file_.string()) +
                                     "; free some space or choose another --out");
    }

    fs::path file_;
    FileDescriptor out_;
    std::string rows_;  // not yet written
};

/// Observes a run: keeps what its result says, and writes tables and pictures while it goes on. Without a
/// folder it writes nothing.
class SimulateRecord : public sim::DistributedObserver {
public:
    /// `last`: the step that ends the run at the latest.
    SimulateRecord(const SimulateOptions& options, const Scene& scene, std::uint64_t last,
                   std::unique_ptr<OutputFolder> folder)
        : options_(options), scene_(scene), last_(last), bar_(options.progress), folder_(std::move(folder)) {
        result_.scene = scene.file, result_.name = scene.name;
        result_.dt_s = scene.world.settings.dt;
        result_.rest_wanted = options.until_rest;
        result_.worker_options = options.workers;
    }

    void at(std::uint64_t step, const sim::World& world) override {
        constexpr std::uint64_t kMomentumEvery =
            10;  // [steps] the sum over all bodies holds up workers' messages
        if (step == 0)
            start(world);
        else
            result_.body_steps += std::uint64_t(world.bodies());
        watch_spin(step, world);
        if (energy_) energy_->add(energy_row(world, !options_.workers));
        // Where rest may end the run any step may be the last.
        const bool perhaps_last = step == last_ || options_.until_rest;
        if (perhaps_last || !options_.workers || step % kMomentumEvery == 0) momentum_->look(world);
        if (perhaps_last) describe(world);
        bar_.show(last_ > 0 ? double(step) / double(last_) : 1);
    }

    /// Takes frames: the first state that is not before a frame's time.
    void ready(std::uint64_t, const sim::World& world) override {
        if (!folder_) return;
        for (; double(next_frame_) / options_.fps <= world.time_s() + 1e-9; ++next_frame_) {
            for (int body = 0; body < world.bodies(); ++body)
                states_->add(state_row(scene_, world, body, next_frame_));
            if (frames_) frames_->push({.index = next_frame_, .state = stage_->frame(world)});
        }
    }

    void worked(const sim::WorkerStep& s) override {
        if (!steps_) return;
        steps_->add(options_.workers ? csv_line({s.worker, s.step, s.seconds, s.smoothed_s, s.waited_s,
                                                 s.bodies, s.lead, s.ghost_age, s.bytes, s.cross_contacts})
                                     : csv_line({s.step, s.seconds}));
        if (options_.workers) history_.add(s);
    }

    void note(const std::string& what) override { result_.notes.push_back(what); }

    /// After the last step; `wall`: since the scene was read.
    [[nodiscard]] SimulateResult finish(const sim::DistributedResult& run, const WallTimer& wall,
                                        std::optional<KeptAccuracy> accuracy) {
        bar_.clear();
        result_.accuracy = std::move(accuracy);
        take_result(run);
        result_.wall_s = wall.seconds();
        if (folder_) write_products(wall);
        return std::move(result_);
    }

private:
    void start(const sim::World& world) {
        momentum_.emplace(scene_, world);
        result_.energy_start = world.energy();
        if (!folder_) return;
        const auto table = [&](const char* name, const char* header) {
            return std::make_unique<GrowingTable>(folder_->path(name), header);
        };
        states_ = table("states.csv", kStates);
        energy_ = table("energy.csv", kEnergy);
        steps_ = options_.workers ? table("timing.csv", kTiming) : table("times.csv", kTimes);
        if (!options_.frames) return;
        fs::create_directory(folder_->path("frames"));
        stage_ = std::make_unique<SceneStage>(scene_, world);
        const FrameThreadOptions where{options_.width, options_.height, folder_->path("frames")};
        frames_ = std::make_unique<FrameThread>(
            std::vector{stage_->description(options_.width, options_.height)}, stage_->frame(world), where);
    }

    void watch_spin(std::uint64_t step, const sim::World& world) {
        constexpr double kMost = 0.01;
        spun_.resize(std::size_t(world.bodies()));
        for (int body = 0; body < world.bodies(); ++body) {
            if (spun_[std::size_t(body)] || world.fidelity(body).fidelity == sim::Fidelity::rigid ||
                sim::centrifugal_stretch(world, body) <= kMost)
                continue;
            spun_[std::size_t(body)] = true;
            result_.mishaps.spun.push_back({name_of(scene_, body), step});
        }
    }

    void describe(const sim::World& world) {
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

    void take_result(const sim::DistributedResult& run) {
        static_cast<sim::DistributedResult&>(result_) = run;
        for (const sim::QuarantinedBody& q : run.quarantined)
            result_.mishaps.quarantined.push_back({name_of(scene_, q.body), q.step, q.what});
        for (const sim::FirstStep& c : run.broken)
            result_.mishaps.broken.push_back(
                {scene_.world.constraints.at(std::size_t(c.number)).name, c.step});
        for (const sim::FirstStep& b : run.limited)
            result_.mishaps.limited.push_back({name_of(scene_, b.number), b.step});
        // Of what cannot follow its deformation anyway nothing more is said.
        std::erase_if(result_.mishaps.spun, [this](const Mishap& spun) {
            return std::ranges::count(result_.mishaps.limited, spun.name, &Mishap::name) > 0;
        });
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

    void write_products(const WallTimer& wall) {
        folder_->free_reserve();
        for (GrowingTable* table : {states_.get(), energy_.get(), steps_.get()}) table->finish();
        if (frames_) frames_->finish();
        if (options_.workers)
            folder_->adorn("workers.svg", [&] {
                Plotter plotter(folder_->scratch());
                const std::string plot = plotter.draw({workers_plot(history_)}).front();
                if (plot.empty()) throw std::runtime_error(plotter.failure());
                write_file(folder_->path("workers.svg"), plot);
            });
        result_.frames = frames_ ? frames_->report().written.size() : 0;
        std::optional<OutputFile> video;
        if (options_.video)
            folder_->adorn("", [&] {
                video.emplace(*options_.video);
                make_video(video->partial(), options_.fps, false, folder_->path("."));
            });
        result_.wall_s = wall.seconds();
        write_file(folder_->path("summary.json"), format_simulate(result_));
        folder_->finish();
        if (video) folder_->adorn("", [&] { video->finish(); });
        result_.failures = folder_->failures();
    }

    const SimulateOptions& options_;
    const Scene& scene_;
    std::uint64_t last_;
    SimulateResult result_;
    ProgressBar bar_;
    std::optional<MomentumWatch> momentum_;
    std::unique_ptr<OutputFolder> folder_;
    std::unique_ptr<GrowingTable> states_, energy_, steps_;
    std::unique_ptr<SceneStage> stage_;
    std::unique_ptr<FrameThread> frames_;
    WorkerHistory history_;
    std::vector<bool> spun_;  // of each body, that it was told
    std::size_t next_frame_ = 0;
};

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
        tell(fmt::format("listening: musicworld worker --connect {}{}", endpoint, key));
}

sim::DistributedLaunch launch_of(const WorkerOptions& workers) {
    sim::DistributedLaunch launch;
    launch.processes = {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers.count};
    launch.listen = workers.listen;
    launch.expect = workers.expect;
    launch.verify = workers.verify;
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
    if (options.until_rest && !scene.world.settings.sleeping)
        throw BadInput(fmt::format(
            "{}: error: found sleeping = false, expected true for --until rest; change one of them",
            scene.file.string()));
    if ((options.frames || options.video) && !options.out)
        throw BadInput("error: found --frames or --video without --out, expected a folder for the pictures");
    if (options.video) {
        const OutputFile can_be(*options.video);
        if (options.width % 2 != 0 || options.height % 2 != 0)
            throw BadInput(fmt::format("error: found --video with --size {}x{}, expected even sides",
                                       options.width, options.height));
        require_ffmpeg();
    }
    if (options.workers && options.out) require_gnuplot();
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
            {"verify", r.worker_options->verify},
            {"workers_lost", r.lost},
            {"workers_left", r.left},
            {"bodies_reowned", r.bodies_reowned},
            {"trades", r.trades},
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
    if (options.out) folder = std::make_unique<OutputFolder>(*options.out, kSimulateProducts);
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
        SimulateRecord record(options, scene, steps, std::move(folder));
        const sim::DistributedResult done = run(scene, options, settings, record);
        return record.finish(done, wall, std::move(accuracy));
    } catch (const sim::InputError& wrong) {
        if (!wrong.names_place()) throw;
        throw BadInput(
            fmt::format("{}: error: {}", scene.file.string(), wrong.what()));  // no single key shows it
    }
}

std::string format_simulate(const SimulateResult& r) {
    const WorkerOptions options = r.worker_options.value_or(WorkerOptions{});
    Json json = {
        {"scene", r.scene.string()},
        {"bodies", r.bodies},
        {"steps", r.steps},
        {"dt_s", r.dt_s},
        {"workers", r.workers},
        {"mode", mode_name(options.pace)},
        {"bound", options.bound},
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
