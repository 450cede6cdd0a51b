#include "simulate/simulate_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "report/table.h"
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

constexpr std::size_t kMostPoints = 4000;
constexpr int kWidth = 900, kPanel = 260, kFrame = 56;

/// A line colour for each worker, repeating after the tenth: "rgb '#rrggbb'".
std::string worker_colour(std::size_t number) {
    constexpr std::array<const char*, 10> kColours = {"#2468b4", "#c07a12", "#2b9a48", "#6b46c1", "#e03131",
                                                      "#0f8a8a", "#b5179e", "#5d6874", "#8a5a2b", "#7c8fd6"};
    return fmt::format("rgb '{}'", kColours[number % kColours.size()]);
}

std::string lines(const std::vector<WorkerHistory::Point>& points, bool seconds) {
    std::string text;
    for (const WorkerHistory::Point& p : points)
        seconds ? fmt::format_to(std::back_inserter(text), "{} {:.6g}\n", p.step, 1e3 * p.seconds)
                : fmt::format_to(std::back_inserter(text), "{} {}\n", p.step, p.bodies);
    return text;
}

std::string panel(const WorkerHistory& history, bool seconds) {
    PlotPanel panel;
    for (const auto& [worker, points] : history.workers())
        panel.add(lines(points, seconds),
                  fmt::format("with {} lw 1.4 lc {} title 'worker {}'", seconds ? "lines" : "steps",
                              worker_colour(static_cast<std::size_t>(worker)), worker));
    return panel.text();
}

using Json = nlohmann::ordered_json;

Json json_of(const Eigen::Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}

/// What is left out of the first part of the summary.
Json details_of(const SimulateResult& r) {
    Json quarantined = Json::array();
    for (const auto& [name, q] : r.quarantined)
        quarantined.push_back({{"body", name}, {"step", q.step}, {"what", q.what}});
    const sim::World::Energy& e = r.energy;
    const sim::WorldCounts& n = r.counts;
    const MomentumDrift drift = r.drift.value_or(MomentumDrift{kNoValue, {}, 0});
    Json details = {
        {"name", r.name},
        {"time_s", r.time_s},
        {"fidelity",
         {{"rigid", r.rigid}, {"linear", r.linear}, {"modal", r.modal}, {"groups_cut", r.groups_cut}}},
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
        {"at_rest", r.rest_reached},
        {"frames", r.frames},
        {"notes", r.notes},
        {"wall_s", r.wall_s},
        {"versions", {{"musicworld", MUSICWORLD_VERSION}}}};
    if (r.workers) details["counts"] = Json();  // workers do not send theirs
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
    const sim::DistributedResult& w = *r.workers;
    return {{"clock", clock_of(r.worker_options)},
            {"balance", r.worker_options.balance},
            {"workers_lost", w.lost},
            {"workers_left", w.left},
            {"bodies_reowned", w.bodies_reowned},
            {"trades", w.trades},
            {"bytes_per_body_step", r.body_steps > 0 ? Json(double(w.bytes) / double(r.body_steps)) : Json()},
            {"largest_lead", w.largest_lead},
            {"largest_ghost_age", w.largest_ghost_age},
            {"refused_messages", w.refused_messages}};
}

}  // namespace

MomentumWatch::MomentumWatch(const sim::WorldScene& scene, const sim::World& world) : scene_(scene) {
    closed_ = scene.world.planes.empty() && scene.events.empty();
    for (const sim::PointConstraint& c : scene.world.constraints) closed_ = closed_ && c.body_b >= 0;
    for (int body = 0; closed_ && body < world.bodies(); ++body) {
        const sim::WorldBody& definition = world.definition(body);
        closed_ = !definition.fixed && definition.damping_alpha == 0;
        weight_ += world.rigid_mass(body).mass * definition.gravity_scale * scene.world.settings.gravity;
    }
    momentum_ = world.momentum(), angular_momentum_ = world.angular_momentum();
    look(world);
}

void MomentumWatch::look(const sim::World& world) {
    double sum = 0;
    for (int body = 0; body < world.bodies(); ++body)
        if (!world.definition(body).fixed)
            sum += world.rigid_mass(body).mass * world.state(body).velocity.norm();
    scale_ = std::max(scale_, sum);
    gained_ = world.momentum() - momentum_ - brought(world);
    if (!closed_) return;
    linear_ = std::max(linear_, (gained_ - weight_ * world.time_s()).norm());
    if (weight_.isZero())
        angular_ = std::max(angular_, (world.angular_momentum() - angular_momentum_).norm());
}

/// Momentum of bodies that came later, as they came.
Eigen::Vector3d MomentumWatch::brought(const sim::World& world) const {
    Eigen::Vector3d sum(0, 0, 0);
    for (int body = static_cast<int>(scene_.world.bodies.size()); body < world.bodies(); ++body)
        if (!world.definition(body).fixed)
            sum += world.rigid_mass(body).mass * world.definition(body).velocity;
    return sum;
}

std::optional<MomentumDrift> MomentumWatch::drift(const std::optional<Eigen::Vector3d>& outside) const {
    if (closed_)
        return MomentumDrift{linear_, weight_.isZero() ? std::optional(angular_) : std::nullopt, scale_};
    if (!outside) return {};
    return MomentumDrift{(gained_ - *outside).norm(), {}, scale_};
}

void WorkerHistory::add(const sim::WorkerStep& step) {
    if (step.step % every_ != 0) return;
    std::vector<Point>& points = workers_[step.worker];
    points.push_back({step.step, step.bodies, step.seconds});
    if (points.size() < kMostPoints) return;
    every_ *= 2;
    for (auto& [worker, kept] : workers_)
        std::erase_if(kept, [&](const Point& p) { return p.step % every_ != 0; });
}

PlotScript workers_plot(const WorkerHistory& history) {
    constexpr int kHeight = 2 * kPanel + kFrame;
    std::string commands = plot_axes() +
                           "set key outside right top\nset multiplot\nset lmargin at screen "
                           "0.085\nset rmargin at screen 0.86\nset yrange [0:]\n";
    commands += plot_margins(12, kPanel - 12, kHeight) + "set format x ''\nset ylabel 'bodies per worker'\n" +
                panel(history, false);
    commands += plot_margins(kPanel + 12, 2 * kPanel - 6, kHeight) +
                "unset key\nset format x '%g'\nset xlabel 'step'\nset ylabel 'ms per step'\n" +
                panel(history, true);
    return {kWidth, kHeight, commands + "unset multiplot\n"};
}

GrowingTable::GrowingTable(const std::filesystem::path& file, const std::string& header)
    : file_(file), out_(file, std::ios::binary) {
    add(header);
}

void GrowingTable::check() const {
    if (!out_)
        throw std::runtime_error(fmt::format(
            "{}: error: found \"{}\", expected to write the simulation's results; free some space "
            "or choose another --out",
            file_.string(), std::strerror(errno)));
}

void GrowingTable::add(const std::string& rows) {
    out_ << rows;
    check();
}

void GrowingTable::finish() {
    out_.close();
    check();
}

SimulateRecord::SimulateRecord(const SimulateOptions& options, const Scene& scene, std::uint64_t last)
    : options_(options), scene_(scene), last_(last), bar_(options.progress) {
    result_.scene = scene.file, result_.name = scene.name;
    result_.dt_s = scene.world.settings.dt;
    result_.rest_wanted = options.until_rest;
    if (options.workers) result_.worker_options = *options.workers;
    if (options.out) folder_ = std::make_unique<OutputFolder>(*options.out, kSimulateProducts);
}

void SimulateRecord::start(const sim::World& world) {
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
    frames_ = std::make_unique<FrameThread>(std::vector{stage_->description(options_.width, options_.height)},
                                            stage_->frame(world), where);
}

void SimulateRecord::at(std::uint64_t step, const sim::World& world) {
    constexpr std::uint64_t kMomentumEvery =
        10;  // [steps] the sum over all bodies holds up workers' messages
    if (step == 0)
        start(world);
    else
        result_.body_steps += std::uint64_t(world.bodies());
    if (energy_) energy_->add(energy_row(world, !options_.workers));
    // Where rest may end the run any step may be the last.
    const bool perhaps_last = step == last_ || options_.until_rest;
    if (perhaps_last || !options_.workers || step % kMomentumEvery == 0) momentum_->look(world);
    if (perhaps_last) describe(world);
    bar_.show(last_ > 0 ? double(step) / double(last_) : 1);
}

void SimulateRecord::ready(std::uint64_t, const sim::World& world) {
    if (!folder_) return;
    for (; double(next_frame_) / options_.fps <= world.time_s() + 1e-9; ++next_frame_) {
        for (int body = 0; body < world.bodies(); ++body)
            states_->add(state_row(scene_, world, body, next_frame_));
        if (frames_) frames_->push({.index = next_frame_, .state = stage_->frame(world)});
    }
}

void SimulateRecord::worked(const sim::WorkerStep& s) {
    if (!steps_) return;
    steps_->add(options_.workers ? csv_line({s.worker, s.step, s.seconds, s.smoothed_s, s.waited_s, s.bodies,
                                             s.lead, s.ghost_age, s.bytes, s.cross_contacts})
                                 : csv_line({s.step, s.seconds}));
    if (options_.workers) history_.add(s);
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

SimulateResult SimulateRecord::finish(const sim::DistributedResult& run, const WallTimer& wall) {
    bar_.clear();
    take_result(run);
    result_.wall_s = wall.seconds();
    if (folder_) write_products(wall);
    return std::move(result_);
}

void SimulateRecord::write_products(const WallTimer& wall) {
    for (GrowingTable* table : {states_.get(), energy_.get(), steps_.get()}) table->finish();
    if (frames_) frames_->finish();
    if (options_.workers) {
        fs::create_directories(folder_->scratch());
        write_file(folder_->path("workers.svg"),
                   draw_svg({workers_plot(history_)}, folder_->scratch()).front());
    }
    result_.frames = frames_ ? frames_->report().written.size() : 0;
    if (options_.video) make_video(*options_.video, options_.fps, false, folder_->path("."));
    result_.wall_s = wall.seconds();
    write_file(folder_->path("summary.json"), format_simulate(result_));
    folder_->finish();
    if (options_.video) fs::rename(options_.video->string() + ".partial", *options_.video);
}

std::string format_simulate(const SimulateResult& r) {
    const sim::DistributedResult workers = r.workers.value_or(sim::DistributedResult{});
    Json json = {
        {"scene", r.scene.string()},
        {"bodies", r.bodies},
        {"steps", r.steps},
        {"dt_s", r.dt_s},
        {"workers", workers.workers},
        {"mode", mode_name(r.worker_options.pace)},
        {"bound", r.worker_options.bound},
        {"elapsed_s", r.elapsed_s},
        {"cpu_s", r.cpu_s},
        {"ns_per_body_step", r.body_steps > 0 ? Json(1e9 * r.elapsed_s / double(r.body_steps)) : Json()},
        {"bytes_per_body_update",
         workers.records > 0 ? double(workers.bytes_states) / double(workers.records) : 0.0},
        {"cross_worker_contacts", workers.cross_contacts},
        {"migrations", workers.migrations},
        {"bodies_lost", r.quarantined.size()},
        {"state_hash", fmt::format("{:016x}", r.state_hash)},
        {"momentum_drift", r.drift ? Json(r.drift->share()) : Json()},
        {"energy_j", r.energy.total()}};
    json.update(details_of(r));
    if (r.workers) json.update(workers_of(r));
    return json.dump(2) + "\n";
}

}  // namespace app
