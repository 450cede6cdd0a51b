#include "simulate/simulate_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "files/bad_input.h"
#include "files/output_file.h"
#include "pictures/motion_blur.h"
#include "process/standard_streams.h"
#include "report/table.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr double kSlackS = 1e-9;  // of a frame's time

// The header of each table. states.csv: a body per row at each frame's time; `modes`: its modal coordinates,
// separated by blanks. energy.csv: the world before the first step and after each. times.csv: what each step
// took. timing.csv: each step of each worker, in the order in which they ended.
constexpr const char* kStates = "frame,t_s,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,lx,ly,lz,modes\n";
constexpr const char* kEnergy =
    "step,t_s,kinetic_j,potential_j,elastic_j,springs_j,px,py,pz,lx,ly,lz,contacts,pairs,islands,asleep\n";
constexpr const char* kTimes = "step,elapsed_s\n";
constexpr const char* kTiming =
    "worker,step,seconds,smoothed_s,waited_s,bodies,lead,ghost_age,bytes,cross_contacts\n";

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

}  // namespace

const std::string& name_of(const Scene& scene, int body) {
    const auto b = static_cast<std::size_t>(body), now = scene.world.bodies.size();
    return b < now ? scene.world.bodies[b].name : scene.later[b - now].name;
}

SimulateRecord::SimulateRecord(const SimulateOptions& options, const Scene& scene, std::uint64_t last,
                               std::unique_ptr<OutputFolder> folder, Checkpoint run)
    : options_(options),
      scene_(scene),
      last_(last),
      bar_(options.progress),
      folder_(std::move(folder)),
      run_(std::move(run)),
      from_(options.goes_on ? &run_.record : nullptr) {
    result_.scene = scene.file, result_.name = scene.name;
    result_.dt_s = scene.world.settings.dt;
    result_.rest_wanted = options.until_rest;
    result_.worker_options = options.workers;
}

void SimulateRecord::done(std::uint64_t step, const std::function<sim::RunState()>& state) {
    if (options_.checkpoint == 0 || step % options_.checkpoint != 0) return;
    // Without a table the run is lost; without a checkpoint it is not.
    const std::array tables = {states_->save(), energy_->save(), steps_->save()};
    try {
        Checkpoint now = run_;
        now.record = save_record();
        std::ranges::copy(tables, now.record.table_bytes.begin());
        now.state = sim::encode(state());
        write_finished_file(folder_->scratch() / "checkpoint", format_checkpoint(now));
        folder_->keep();
        failing_ = false;
    } catch (const std::runtime_error& failed) {
        if (!std::exchange(failing_, true))
            tell(fmt::format("{}; the run goes on without a checkpoint of step {}", failed.what(), step));
    }
}

void SimulateRecord::at(std::uint64_t step, const sim::World& world) {
    constexpr std::uint64_t kMomentumEvery =
        10;  // [steps] the sum over all bodies holds up workers' messages
    if (step == 0) {
        start(world);
        if (from_) return;  // to be called again
    } else {
        result_.body_steps += std::uint64_t(world.bodies());
    }
    watch_spin(step, world);
    if (energy_) energy_->add(energy_row(world, !options_.workers));
    // Where rest may end the run any step may be the last.
    const bool perhaps_last = step == last_ || options_.until_rest;
    if (perhaps_last || !options_.workers || step % kMomentumEvery == 0) momentum_->look(world);
    if (perhaps_last) describe(world);
    bar_.show(last_ > 0 ? double(step) / double(last_) : 1);
}

void SimulateRecord::ready(std::uint64_t, const sim::World& world) {
    if (!folder_) return;
    const double t_s = world.time_s();
    std::optional<render::FrameState> now;
    if (frames_ && options_.shutter > 0) now = stage_->frame(world);
    for (;; ++next_frame_) {
        if (now) expose(*now, t_s);
        if (!(double(next_frame_) / options_.fps <= t_s + kSlackS)) break;
        for (int body = 0; body < world.bodies(); ++body)
            states_->add(state_row(scene_, world, body, next_frame_));
        if (frames_)
            frames_->push({.index = next_frame_,
                           .state = now ? *now : stage_->frame(world),
                           .earlier = std::exchange(exposed_, {})});
    }
    reached_ = std::move(now), reached_s_ = t_s;
}

void SimulateRecord::expose(const render::FrameState& now, double t_s) {
    const std::vector<double> moments =
        exposure_times(double(next_frame_) / options_.fps, options_.shutter / options_.fps);
    // The last moment is the frame's own state.
    while (exposed_.size() + 1 < moments.size() && moments[exposed_.size()] <= t_s + kSlackS) {
        const double share = (moments[exposed_.size()] - reached_s_) / (t_s - reached_s_);
        const bool within = reached_ && share < 1;
        exposed_.push_back(within ? between(*reached_, now, static_cast<float>(share)) : now);
    }
}

void SimulateRecord::worked(const sim::WorkerStep& s) {
    if (!steps_) return;
    steps_->add(options_.workers ? csv_line({s.worker, s.step, s.seconds, s.smoothed_s, s.waited_s, s.bodies,
                                             s.lead, s.ghost_age, s.bytes, s.cross_contacts})
                                 : csv_line({s.step, s.seconds}));
    if (options_.workers) history_.add(s);
}

void SimulateRecord::note(const std::string& what) {
    result_.notes.push_back(what);
    const bool is_usual =
        !options_.workers || (options_.workers->listen.empty() && what.find(" joins") != std::string::npos);
    if (is_usual || !options_.progress) return;
    bar_.clear();
    tell(fmt::format("{}: note: {}", result_.scene.string(), what));
}

SimulateResult SimulateRecord::finish(const sim::DistributedResult& run, const WallTimer& wall,
                                      std::optional<KeptAccuracy> accuracy) {
    bar_.clear();
    result_.accuracy = std::move(accuracy);
    take_result(run);
    const double before = from_ ? from_->wall_s : 0;
    result_.wall_s = before + wall.seconds();
    if (folder_) write_products(wall, before);
    return std::move(result_);
}

void SimulateRecord::start(const sim::World& world) {
    momentum_.emplace(scene_, world, options_.workers.has_value());
    result_.energy_start = world.energy();
    if (from_) go_on();
    if (!folder_) return;
    const auto table = [&](const char* name, const char* header, std::size_t number) {
        if (!from_) return std::make_unique<GrowingTable>(folder_->path(name), header);
        folder_->take_back(name);
        return std::make_unique<GrowingTable>(folder_->path(name), from_->table_bytes[number]);
    };
    states_ = table("states.csv", kStates, 0);
    energy_ = table("energy.csv", kEnergy, 1);
    steps_ = options_.workers ? table("timing.csv", kTiming, 2) : table("times.csv", kTimes, 2);
    if (!options_.frames && !options_.video) return;
    if (from_) find_frames();
    fs::create_directory(folder_->path("frames"));
    stage_ = std::make_unique<SceneStage>(scene_, world, options_.camera);
    const FrameThreadOptions where{options_.width, options_.height, folder_->path("frames")};
    frames_ = std::make_unique<FrameThread>(std::vector{stage_->description(options_.width, options_.height)},
                                            stage_->frame(world), where);
}

void SimulateRecord::go_on() {
    next_frame_ = saved_frames_ = from_->next_frame;
    result_.body_steps = from_->body_steps;
    momentum_->go_on(from_->momentum);
    spun_.resize(scene_.looks.size());
    for (const auto& [body, step] : from_->spun) {
        if (body < 0 || std::size_t(body) >= spun_.size())
            throw BadInput(fmt::format("{}: error: found body {}, expected one of the scene's {}",
                                       checkpoint_file(*options_.out).string(), body, spun_.size()));
        tell_spun(body, step);
    }
}

fs::path SimulateRecord::frame(std::uint64_t index) const {
    return folder_->path("frames") / fmt::format("{:06}.png", index);
}

void SimulateRecord::find_frames() {
    folder_->take_back("frames");
    std::error_code none;
    for (std::uint64_t i = 0; i < next_frame_; ++i)
        if (!fs::is_regular_file(frame(i), none))
            throw BadInput(
                fmt::format("{}: error: found no such picture, expected the {} that were drawn when the "
                            "checkpoint was saved",
                            frame(i).string(), next_frame_));
}

RecordState SimulateRecord::save_record() {
    RecordState r;
    if (frames_) {
        frames_->drain();
        for (; saved_frames_ < next_frame_; ++saved_frames_) save_on_disk(frame(saved_frames_));
        save_on_disk(folder_->path("frames"));
    }
    save_on_disk(folder_->path("."));
    save_on_disk(*options_.out);
    r.next_frame = next_frame_;
    r.body_steps = result_.body_steps;
    r.momentum = momentum_->largest();
    r.spun = reported_spun_;
    r.wall_s = (from_ ? from_->wall_s : 0) + since_start_.seconds();
    return r;
}

void SimulateRecord::tell_spun(int body, std::uint64_t step) {
    spun_[std::size_t(body)] = true;
    reported_spun_.emplace_back(body, step);
    result_.mishaps.spun.push_back({name_of(scene_, body), step});
}

void SimulateRecord::watch_spin(std::uint64_t step, const sim::World& world) {
    constexpr double kMost = 0.01;
    spun_.resize(scene_.looks.size());
    for (int body = 0; body < world.bodies(); ++body) {
        if (spun_[std::size_t(body)] || world.fidelity(body).fidelity == sim::Fidelity::rigid ||
            sim::centrifugal_stretch(world, body) <= kMost)
            continue;
        tell_spun(body, step);
    }
}

void SimulateRecord::describe(const sim::World& world) {
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

void SimulateRecord::take_result(const sim::DistributedResult& run) {
    static_cast<sim::DistributedResult&>(result_) = run;
    for (const sim::QuarantinedBody& q : run.quarantined)
        result_.mishaps.quarantined.push_back({name_of(scene_, q.body), q.step, q.what});
    for (const sim::FirstStep& c : run.broken)
        result_.mishaps.broken.push_back({scene_.world.constraints.at(std::size_t(c.number)).name, c.step});
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

void SimulateRecord::write_products(const WallTimer& wall, double before_s) {
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
    result_.frames = frames_ ? next_frame_ : 0;
    std::unique_ptr<OutputFile> video;
    if (options_.video)
        folder_->adorn(
            "", [&] { video = make_video(*options_.video, options_.fps, 0, false, folder_->path(".")); });
    result_.wall_s = before_s + wall.seconds();
    write_file(folder_->path("summary.json"), format_simulate(result_));
    folder_->finish();
    if (video)
        folder_->adorn("", [&] {
            video->finish();
            if (!options_.frames) folder_->remove_product("frames");
        });
    result_.failures = folder_->failures();
}

}  // namespace app
