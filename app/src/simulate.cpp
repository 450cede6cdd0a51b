#include "simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <stdexcept>

#include "bad_input.h"
#include "frame_writer.h"
#include "machine_speed.h"
#include "output_folder.h"
#include "play_products.h"
#include "play_setup.h"
#include "progress_bar.h"
#include "scene_stage.h"
#include "simulate_tables.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestRestS = 600;  // --until rest gives up after this much time of the scene

/// Sums over the bodies what the world's total momentum must be if nothing acts but gravity.
class DriftWatch {
public:
    DriftWatch(const Scene& scene, const sim::World& world) : world_(world) {
        closed_ = scene.world.planes.empty() && scene.events.empty();
        for (const sim::PointConstraint& c : scene.world.constraints) closed_ = closed_ && c.body_b >= 0;
        for (int body = 0; closed_ && body < world.bodies(); ++body) {
            const sim::WorldBody& definition = world.definition(body);
            closed_ = !definition.fixed && definition.damping_alpha == 0;
            weight_ += world.rigid_mass(body).mass * definition.gravity_scale * scene.world.settings.gravity;
        }
        momentum_ = world.momentum(), angular_ = world.angular_momentum();
        look();
    }
    /// After each step.
    void look() {
        if (!closed_) return;
        const Eigen::Vector3d expected = momentum_ + weight_ * world_.time_s();
        drift_.linear = std::max(drift_.linear, (world_.momentum() - expected).norm());
        if (weight_.isZero())
            drift_.angular = std::max(drift_.angular, (world_.angular_momentum() - angular_).norm());
        double sum = 0;
        for (int body = 0; body < world_.bodies(); ++body)
            sum += world_.rigid_mass(body).mass * world_.state(body).velocity.norm();
        drift_.scale = std::max(drift_.scale, sum);
    }
    [[nodiscard]] std::optional<MomentumDrift> drift() const {
        return closed_ && world_.quarantined().empty() ? std::optional(drift_) : std::nullopt;
    }

private:
    const sim::World& world_;
    bool closed_ = false;
    Eigen::Vector3d weight_ = Eigen::Vector3d::Zero(), momentum_, angular_;
    MomentumDrift drift_;
};

/// What a run writes while it goes on. Without a folder: nothing.
class Record {
public:
    Record(const SimulateOptions& options, const Scene& scene, const sim::World& world)
        : options_(options), scene_(scene) {
        if (!options.out) return;
        folder_ = std::make_unique<OutputFolder>(*options.out, simulate_products());
        states_ = std::make_unique<GrowingTable>(folder_->path("states.csv"), states_header());
        energy_ =
            std::make_unique<GrowingTable>(folder_->path("energy.csv"), energy_header() + energy_row(world));
        times_ = std::make_unique<GrowingTable>(folder_->path("times.csv"), times_header());
        if (!options.frames) return;
        fs::create_directory(folder_->path("frames"));
        stage_ = std::make_unique<SceneStage>(scene, world);
        frames_ = std::make_unique<FrameWriter>(stage_->description(options.width, options.height),
                                                stage_->frame(world), folder_->path("frames"));
    }

    /// The state at the first step that is not before the frame's time.
    void take_frames(const sim::World& world) {
        if (!folder_) return;
        while (double(next_frame_) / options_.fps <= world.time_s() + 1e-9) {
            states_->add(state_rows(scene_, world, next_frame_));
            if (frames_) frames_->push(stage_->frame(world));
            ++next_frame_;
        }
    }
    void take_step(const sim::World& world, double elapsed_s) {
        if (!folder_) return;
        energy_->add(energy_row(world));
        times_->add(times_row(world, elapsed_s));
    }
    void finish(SimulateResult& result, const WallTimer& wall) {
        if (!folder_) return;
        for (GrowingTable* table : {states_.get(), energy_.get(), times_.get()}) table->finish();
        if (frames_) frames_->finish();
        result.frames = frames_ ? frames_->frames() : 0;
        if (options_.video) make_video(*options_.video, options_.fps, false, folder_->path("."));
        result.wall_s = wall.seconds();
        write_file(folder_->path("summary.json"), format_simulate(result));
        folder_->finish();
        if (options_.video) fs::rename(options_.video->string() + ".partial", *options_.video);
    }

private:
    const SimulateOptions& options_;
    const Scene& scene_;
    std::unique_ptr<OutputFolder> folder_;
    std::unique_ptr<GrowingTable> states_, energy_, times_;
    std::unique_ptr<SceneStage> stage_;
    std::unique_ptr<FrameWriter> frames_;
    std::size_t next_frame_ = 0;
};

class Run {
public:
    Run(const SimulateOptions& options, const Scene& scene)
        : options_(options), scene_(scene), world_(scene.world) {
        result_.scene = scene.file, result_.name = scene.name;
        result_.dt_s = scene.world.settings.dt;
        result_.rest_wanted = options.until_rest;
        result_.energy_start = world_.energy();
    }
    SimulateResult run();

private:
    [[nodiscard]] std::uint64_t last_step() const;
    [[nodiscard]] bool at_rest() const { return next_event_ == scene_.events.size() && world_.all_asleep(); }
    void play_events();
    double step();
    void sum_up();

    const SimulateOptions& options_;
    const Scene& scene_;
    sim::World world_;
    std::size_t next_event_ = 0;
    SimulateResult result_;
};

std::uint64_t Run::last_step() const {
    if (options_.steps) return *options_.steps;
    const double seconds = options_.seconds.value_or(options_.until_rest ? kLongestRestS : scene_.seconds);
    return std::uint64_t(std::llround(std::ceil(seconds / result_.dt_s - 1e-6)));
}

void Run::play_events() {
    for (; next_event_ < scene_.events.size() && scene_.events[next_event_].step <= result_.steps;
         ++next_event_) {
        const SceneEvent& event = scene_.events[next_event_];
        for (const int constraint : event.removed)
            if (world_.constraint_holds(constraint)) world_.remove_constraint(constraint);
        for (std::size_t k = event.first; k < event.end; ++k) (void)world_.add_body(scene_.later[k]);
        if (event.slowing)
            result_.notes.push_back(
                fmt::format("at {} s worker {} is to be slower {} times: not done, as there are no workers "
                            "in one process",
                            double(event.step) * result_.dt_s, event.slowing->worker, event.slowing->factor));
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

void Run::sum_up() {
    result_.bodies = world_.bodies();
    for (int body = 0; body < world_.bodies(); ++body) {
        const sim::FidelityChoice choice = world_.fidelity(body);
        const sim::Fidelity fidelity = choice.fidelity;
        result_.groups_cut += choice.cut.below < choice.cut.count;
        (fidelity == sim::Fidelity::rigid    ? result_.rigid
         : fidelity == sim::Fidelity::linear ? result_.linear
                                             : result_.modal) += 1;
    }
    result_.time_s = world_.time_s();
    result_.energy = world_.energy();
    result_.momentum = world_.momentum(), result_.angular_momentum = world_.angular_momentum();
    result_.state_hash = world_.state_hash();
    result_.counts = world_.counts();
    result_.rest_reached = at_rest();
    for (const sim::QuarantinedBody& q : world_.quarantined())
        result_.quarantined.emplace_back(world_.definition(q.body).name, q);
}

SimulateResult Run::run() {
    const WallTimer wall;
    Record record(options_, scene_, world_);
    DriftWatch drift(scene_, world_);
    ProgressBar bar(options_.progress);
    const std::uint64_t last = last_step();
    while (result_.steps < last) {
        play_events();
        if (options_.until_rest && at_rest()) break;
        record.take_frames(world_);
        record.take_step(world_, step());
        drift.look();
        bar.show(double(result_.steps) / double(last));
    }
    record.take_frames(world_);
    bar.clear();
    result_.drift = drift.drift();
    sum_up();
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

SimulateResult simulate(const SimulateOptions& options) {
    const Scene scene = read_scene(options.scene, options.dt_s);
    check(options, scene);
    std::unique_ptr<Run> run;
    try {
        run = std::make_unique<Run>(options, scene);
    } catch (const std::invalid_argument& wrong) {  // what no single key shows
        throw BadInput(fmt::format("{}: error: {}", scene.file.string(), wrong.what()));
    }
    return run->run();
}

}  // namespace app
