#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "simulate/simulate.h"

namespace app {
namespace {

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
