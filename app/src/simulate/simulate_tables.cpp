#include "simulate/simulate_tables.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <iterator>
#include <stdexcept>

#include "report/table.h"

namespace app {

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

std::string energy_header() {
    return "step,t_s,kinetic_j,potential_j,elastic_j,springs_j,px,py,pz,lx,ly,lz,contacts,pairs,islands,"
           "asleep\n";
}

std::string energy_row(const sim::World& world, bool stepped) {
    const sim::World::Energy e = world.energy();
    const Eigen::Vector3d p = world.momentum(), l = world.angular_momentum();
    const sim::WorldCounts& n = world.counts();
    const std::string found =
        stepped ? fmt::format("{},{},{},{}", n.contacts, n.pairs, n.islands, n.asleep) : ",,,";
    return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", n.steps, world.time_s(), e.kinetic,
                       e.potential, e.elastic, e.springs, p.x(), p.y(), p.z(), l.x(), l.y(), l.z(), found);
}

std::string times_header() {
    return "step,elapsed_s\n";
}

std::string times_row(std::uint64_t step, double elapsed_s) {
    return fmt::format("{},{}\n", step, elapsed_s);
}

}  // namespace app
