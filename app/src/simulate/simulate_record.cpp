#include "simulate/simulate_record.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "pictures/video.h"
#include "report/table.h"

namespace app {
namespace {

namespace fs = std::filesystem;

// states.csv: a body a row at each frame's time; `modes`: its modal coordinates, separated by blanks.
std::string states_header() {
    return "frame,t_s,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,lx,ly,lz,modes\n";
}

std::string state_rows(const Scene& scene, const sim::World& world, std::size_t frame) {
    fmt::memory_buffer rows;
    const auto out = std::back_inserter(rows);
    for (int body = 0; body < world.bodies(); ++body) {
        const sim::WorldBodyState s = world.state(body);
        const Eigen::Vector3d &p = s.position, &v = s.velocity, &l = s.angular_momentum;
        const Eigen::Quaterniond& q = s.orientation;
        fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},", frame, world.time_s(),
                       csv_field(name_of(scene, static_cast<std::size_t>(body))), p.x(), p.y(), p.z(), q.w(),
                       q.x(), q.y(), q.z(), v.x(), v.y(), v.z(), l.x(), l.y(), l.z());
        for (Eigen::Index k = 0; k < s.q.size(); ++k) fmt::format_to(out, "{}{}", k > 0 ? " " : "", s.q[k]);
        rows.push_back('\n');
    }
    return fmt::to_string(rows);
}

// energy.csv: the world before the first step and after each.
std::string energy_header() {
    return "step,t_s,kinetic_j,potential_j,elastic_j,springs_j,px,py,pz,lx,ly,lz,contacts,pairs,islands,"
           "asleep\n";
}

/// `stepped`: in this process, so that the world knows its contacts; else their cells are empty.
std::string energy_row(const sim::World& world, bool stepped) {
    const sim::World::Energy e = world.energy();
    const Eigen::Vector3d p = world.momentum(), l = world.angular_momentum();
    const sim::WorldCounts& n = world.counts();
    const std::string found =
        stepped ? fmt::format("{},{},{},{}", n.contacts, n.pairs, n.islands, n.asleep) : ",,,";
    return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", n.steps, world.time_s(), e.kinetic,
                       e.potential, e.elastic, e.springs, p.x(), p.y(), p.z(), l.x(), l.y(), l.z(), found);
}

// times.csv: what each step took.
std::string times_header() {
    return "step,elapsed_s\n";
}

std::string times_row(std::uint64_t step, double elapsed_s) {
    return fmt::format("{},{}\n", step, elapsed_s);
}

// timing.csv: each step of each worker, in the order in which they were told.
std::string timing_header() {
    return "worker,step,seconds,smoothed_s,waited_s,bodies,lead,ghost_age,bytes,cross_contacts\n";
}

std::string timing_row(const sim::WorkerStep& s) {
    return fmt::format("{},{},{},{},{},{},{},{},{},{}\n", s.worker, s.step, s.seconds, s.smoothed_s,
                       s.waited_s, s.bodies, s.lead, s.ghost_age, s.bytes, s.cross_contacts);
}

using Json = nlohmann::ordered_json;

Json json_of(const Eigen::Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}

Json json_of(const sim::World::Energy& e) {
    return {
        {"kinetic", e.kinetic}, {"potential", e.potential}, {"elastic", e.elastic}, {"springs", e.springs}};
}

Json json_of(const sim::WorldCounts& n) {
    return {{"contacts", n.contacts},
            {"pairs", n.pairs},
            {"islands", n.islands},
            {"asleep", n.asleep},
            {"inverse_fallbacks", n.inverse_fallbacks},
            {"deformations_limited", n.deformations_limited},
            {"constraints_broken", n.constraints_broken}};
}

/// Share of the momenta that went around.
Json relative_drift(const SimulateResult& r) {
    if (!r.drift) return {};
    return r.drift->scale > 0 ? r.drift->linear / r.drift->scale : r.drift->linear;
}

Json quarantine(const SimulateResult& r) {
    Json all = Json::array();
    for (const auto& [name, q] : r.quarantined)
        all.push_back({{"body", name}, {"step", q.step}, {"what", q.what}});
    return all;
}

void add_details(const SimulateResult& r, Json& json) {
    json["name"] = r.name;
    json["time_s"] = r.time_s;
    json["fidelity"] = {
        {"rigid", r.rigid}, {"linear", r.linear}, {"modal", r.modal}, {"groups_cut", r.groups_cut}};
    json["energy_start_j"] = r.energy_start.total();
    json["energy_parts_j"] = json_of(r.energy);
    json["momentum_kg_m_s"] = json_of(r.momentum);
    json["angular_momentum_kg_m2_s"] = json_of(r.angular_momentum);
    json["momentum_drift_kg_m_s"] = r.drift ? Json(r.drift->linear) : Json();
    json["angular_momentum_drift_kg_m2_s"] = r.drift && r.drift->angular ? Json(*r.drift->angular) : Json();
    json["counts"] = r.workers ? Json() : json_of(r.counts);  // workers do not tell theirs
    json["quarantined"] = quarantine(r);
    json["at_rest"] = r.rest_reached;
    json["frames"] = r.frames;
    json["notes"] = r.notes;
    json["wall_s"] = r.wall_s;
    json["versions"] = {{"musicworld", MUSICWORLD_VERSION}};
}

/// Which clock elapsed_s is of.
std::string clock_of(const WorkerOptions& options) {
    if (!options.simulated) return "wall";
    return fmt::format("simulated processors, {} costs, {} times slower, {} s from worker to worker",
                       options.simulated->modelled ? "modelled" : "measured", options.simulated->slowdown,
                       options.simulated->latency_s);
}

void add_workers(const SimulateResult& r, Json& json) {
    const sim::DistributedResult& w = *r.workers;
    json["clock"] = clock_of(r.worker_options);
    json["balance"] = r.worker_options.balance;
    json["workers_lost"] = w.lost;
    json["workers_left"] = w.left;
    json["bodies_reowned"] = w.bodies_reowned;
    json["trades"] = w.trades;
    json["bytes_per_body_step"] = r.body_steps > 0 ? Json(double(w.bytes) / double(r.body_steps)) : Json();
    json["largest_lead"] = w.largest_lead;
    json["largest_ghost_age"] = w.largest_ghost_age;
    json["refused_messages"] = w.refused_messages;
}

}  // namespace

const std::string& name_of(const Scene& scene, std::size_t body) {
    const std::size_t now = scene.world.bodies.size();
    return body < now ? scene.world.bodies[body].name : scene.later[body - now].name;
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

SimulateRecord::SimulateRecord(const SimulateOptions& options, const Scene& scene)
    : options_(options), scene_(scene) {
    if (options.out) folder_ = std::make_unique<OutputFolder>(*options.out, kSimulateProducts);
}

void SimulateRecord::start(const sim::World& world) {
    if (!folder_) return;
    const auto table = [&](const char* name, const std::string& header) {
        return std::make_unique<GrowingTable>(folder_->path(name), header);
    };
    states_ = table("states.csv", states_header());
    energy_ = table("energy.csv", energy_header() + energy_row(world, !options_.workers));
    if (options_.workers)
        timing_ = table("timing.csv", timing_header());
    else
        times_ = table("times.csv", times_header());
    if (!options_.frames) return;
    fs::create_directory(folder_->path("frames"));
    stage_ = std::make_unique<SceneStage>(scene_, world);
    const FrameThreadOptions where{options_.width, options_.height, folder_->path("frames")};
    frames_ = std::make_unique<FrameThread>(std::vector{stage_->description(options_.width, options_.height)},
                                            stage_->frame(world), where);
}

void SimulateRecord::take_frames(const sim::World& world) {
    if (!folder_) return;
    while (double(next_frame_) / options_.fps <= world.time_s() + 1e-9) {
        states_->add(state_rows(scene_, world, next_frame_));
        if (frames_) frames_->push({.index = next_frame_, .state = stage_->frame(world)});
        ++next_frame_;
    }
}

void SimulateRecord::take_step(const sim::World& world) {
    if (folder_) energy_->add(energy_row(world, !options_.workers));
}

void SimulateRecord::take_worker(const sim::WorkerStep& step) {
    if (times_) times_->add(times_row(step.step, step.seconds));
    if (!timing_) return;
    timing_->add(timing_row(step));
    history_.add(step);
}

void SimulateRecord::draw_workers() {
    fs::create_directories(folder_->scratch());
    write_file(folder_->path("workers.svg"), draw_svg({workers_plot(history_)}, folder_->scratch()).front());
}

void SimulateRecord::finish(SimulateResult& result, const WallTimer& wall) {
    if (!folder_) return;
    for (GrowingTable* table : {states_.get(), energy_.get(), times_.get(), timing_.get()})
        if (table) table->finish();
    if (frames_) frames_->finish();
    if (timing_) draw_workers();
    result.frames = frames_ ? frames_->written().size() : 0;
    if (options_.video) make_video(*options_.video, options_.fps, false, folder_->path("."));
    result.wall_s = wall.seconds();
    write_file(folder_->path("summary.json"), format_simulate(result));
    folder_->finish();
    if (options_.video) fs::rename(options_.video->string() + ".partial", *options_.video);
}

std::string format_simulate(const SimulateResult& r) {
    Json json;
    json["scene"] = r.scene.string();
    json["bodies"] = r.bodies;
    json["steps"] = r.steps;
    json["dt_s"] = r.dt_s;
    json["workers"] = r.workers ? r.workers->workers : 0;
    json["mode"] = mode_name(r.worker_options.pace);
    json["bound"] = r.worker_options.bound;
    json["elapsed_s"] = r.elapsed_s;
    json["cpu_s"] = r.cpu_s;
    json["ns_per_body_step"] = r.body_steps > 0 ? Json(1e9 * r.elapsed_s / double(r.body_steps)) : Json();
    const sim::DistributedResult workers = r.workers.value_or(sim::DistributedResult{});
    json["bytes_per_body_update"] =
        workers.records > 0 ? double(workers.bytes_states) / double(workers.records) : 0.0;
    json["cross_worker_contacts"] = workers.cross_contacts;
    json["migrations"] = workers.migrations;
    json["bodies_lost"] = r.quarantined.size();
    json["state_hash"] = fmt::format("{:016x}", r.state_hash);
    json["momentum_drift"] = relative_drift(r);
    json["energy_j"] = r.energy.total();
    add_details(r, json);
    if (r.workers) add_workers(r, json);
    return json.dump(2) + "\n";
}

}  // namespace app
