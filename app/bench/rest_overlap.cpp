#include "bench/rest_overlap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "process/clock.h"

namespace app {
namespace {

using Eigen::Vector3d;
using sim_bench::RigidPeer;
using sim_bench::RigidState;

constexpr int kMostHalvings = 4;
constexpr int kContactsPerBall = 5;  // twelve neighbours share theirs; a pile is looser

/// How far body i reaches from its centre along a unit vector of the world [m].
using Reach = std::function<double(std::size_t i, const Vector3d& direction)>;

double mean_depth(const std::vector<Vector3d>& centres, double diameter,
                  const std::vector<sim::WorldPlane>& planes, const Reach& reach) {
    double sum = 0;
    int pairs = 0;
    const auto add = [&](double depth) {
        if (depth > 0) sum += depth, ++pairs;
    };
    for (std::size_t a = 0; a < centres.size(); ++a) {
        for (const sim::WorldPlane& plane : planes)
            if (const double height = plane.normal.dot(centres[a]) - plane.offset; height < diameter)
                add(reach(a, -plane.normal) - height);
        for (std::size_t b = 0; b < a; ++b) {
            const Vector3d way = centres[b] - centres[a];
            const double distance = way.norm();
            if (distance > 1.5 * diameter) continue;
            add(reach(a, way / distance) + reach(b, -way / distance) - distance);
        }
    }
    return pairs > 0 ? sum / pairs / diameter : 0;
}

/// A peer whose step is a fraction of ours, as one of our step.
class Divided : public RigidPeer {
public:
    Divided(std::unique_ptr<RigidPeer> peer, int parts) : peer_(std::move(peer)), parts_(parts) {}
    void step() override {
        for (int i = 0; i < parts_; ++i) peer_->step();
    }
    [[nodiscard]] std::vector<RigidState> states() override { return peer_->states(); }
    [[nodiscard]] bool whole() const override { return peer_->whole(); }

private:
    std::unique_ptr<RigidPeer> peer_;
    int parts_;
};

}  // namespace

double mean_overlap(const sim::WorldDefinition& definition, const sim::World& world) {
    std::vector<Vector3d> centres;
    std::vector<sim::WorldBodyState> states;
    for (int i = 0; i < world.bodies(); ++i) {
        states.push_back(world.state(i));
        centres.push_back(states.back().position);
    }
    const double radius = definition.bodies.front().shape.base.semi_axes.x();
    return mean_depth(centres, 2 * radius, definition.planes, [&](std::size_t i, const Vector3d& direction) {
        const Vector3d own = states[i].orientation.conjugate() * direction;
        if (states[i].q.size() == 0) return radius;
        const Vector3d u = sim::mode_shapes_at(world.basis(static_cast<int>(i)), radius * own) * states[i].q;
        return radius + own.dot(u);
    });
}

double mean_overlap(const sim::WorldDefinition& definition, const std::vector<RigidState>& states) {
    std::vector<Vector3d> centres;
    for (const RigidState& s : states) centres.push_back(s.position);
    const double radius = definition.bodies.front().shape.base.semi_axes.x();
    return mean_depth(centres, 2 * radius, definition.planes,
                      [radius](std::size_t, const Vector3d&) { return radius; });
}

std::unique_ptr<RigidPeer> EqualPeer::start(const sim::WorldDefinition& world) const {
    return std::make_unique<Divided>(peer.make(world, settings), 1 << halvings);
}

std::string EqualPeer::words() const {
    return fmt::format("spheres, {}, step of 1/{:.0f} s", settings.method, 1 / settings.dt);
}

std::optional<EqualPeer> cheapest_equal(const sim_bench::PeerLibrary& library,
                                        const sim::WorldDefinition& world, int steps, double most,
                                        double longest_s) {
    std::optional<EqualPeer> best;
    double least_s = 0;
    for (const std::string& method : library.methods)
        for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
            EqualPeer tried{library, {}, halvings, 0};
            tried.settings.dt = std::ldexp(world.settings.dt, -halvings);
            tried.settings.method = method, tried.settings.contacts_per_body = kContactsPerBall;
            const std::unique_ptr<RigidPeer> peer = tried.start(world);
            const int rest = std::min(kRestSteps, steps);
            double spent_s = 0;
            const double most_s = best ? least_s : longest_s;
            for (int done = 0; done < steps && spent_s < most_s; ++done) {
                const double begin = thread_cpu_s();
                peer->step();
                spent_s += thread_cpu_s() - begin;
                if (done >= steps - rest) tried.overlap += mean_overlap(world, peer->states()) / rest;
            }
            if (spent_s >= most_s) break;
            if (peer->whole() && tried.overlap <= most) {
                best = tried, least_s = spent_s;
                break;
            }
        }
    return best;
}

}  // namespace app
