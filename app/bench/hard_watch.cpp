#include "bench/hard_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace app {
namespace {

using Eigen::Vector3d;
using sim_bench::RigidState;

constexpr double kFaster = 1.1;  // of the energy that there is: more is thrown
constexpr double kFurthest_m = 1e7, kFastest_mps = 1e6;

bool is_sphere(const sim::WorldBody& body) {
    return sim_bench::peer_shape(body, false) == sim_bench::PeerShape::sphere;
}

bool is_fair(const RigidState& s) {
    return s.position.allFinite() && s.velocity.allFinite() && s.angular_velocity.allFinite() &&
           s.orientation.coeffs().allFinite() && s.position.norm() < kFurthest_m &&
           s.velocity.norm() < kFastest_mps;
}

/// How far a body reaches along a direction [m].
double half_width(const sim::WorldBody& body, const RigidState& s, const Vector3d& direction) {
    const Vector3d& half = body.shape.base.semi_axes;
    if (is_sphere(body)) return half.x();
    return half.dot((s.orientation.conjugate() * direction).cwiseAbs());
}

/// How deep a sphere is in a box; below 0: the distance.
double sphere_in_box(const Vector3d& center_in_box, double radius, const Vector3d& half) {
    const Vector3d nearest = center_in_box.cwiseMax(-half).cwiseMin(half);
    const double distance = (center_in_box - nearest).norm();
    if (distance > 0) return radius - distance;
    return radius + (half - center_in_box.cwiseAbs()).minCoeff();
}

/// Whether the segment crosses the half of a body about its centre; points in the body's frame.
bool crosses_core(const sim::WorldBody& body, const Vector3d& from, const Vector3d& to) {
    const Vector3d half = 0.5 * body.shape.base.semi_axes, along = to - from;
    if (is_sphere(body)) {
        const double length = along.squaredNorm();
        const double t = length > 0 ? std::clamp(-from.dot(along) / length, 0.0, 1.0) : 0;
        return (from + t * along).norm() < half.x();
    }
    double enters = 0, leaves = 1;
    for (int k = 0; k < 3; ++k) {
        if (along[k] == 0) {
            if (std::abs(from[k]) >= half[k]) return false;
            continue;
        }
        const double a = (-half[k] - from[k]) / along[k], b = (half[k] - from[k]) / along[k];
        enters = std::max(enters, std::min(a, b)), leaves = std::min(leaves, std::max(a, b));
    }
    return enters < leaves;
}

Vector3d seen_from(const RigidState& body, const Vector3d& point) {
    return body.orientation.conjugate() * (point - body.position);
}

/// The same on the paths of a step that the velocities at its ends make likely (cubic Hermite; orientations the shorter
/// way): chains whip round each other within a step, where straight lines cross.
bool crosses_between(const sim::WorldBody& body, const std::array<RigidState, 2>& a,
                     const std::array<RigidState, 2>& b, double dt) {
    constexpr int kPieces = 32;
    const auto at = [&](const std::array<RigidState, 2>& s, double t) -> Vector3d {
        const double u = 1 - t;
        return (1 + 2 * t) * u * u * s[0].position + t * t * (3 - 2 * t) * s[1].position +
               dt * t * u * (u * s[0].velocity - t * s[1].velocity);
    };
    const auto place = [&](int k) {
        const double t = double(k) / kPieces;
        return Vector3d(b[0].orientation.slerp(t, b[1].orientation).conjugate() * (at(a, t) - at(b, t)));
    };
    for (int k = 0; k < kPieces; ++k)
        if (crosses_core(body, place(k), place(k + 1))) return true;
    return false;
}

RigidState state_at_start(const sim::WorldBody& body) {
    return {body.world_from_body.translation(), Eigen::Quaterniond(body.world_from_body.linear()),
            body.fixed ? Vector3d(0, 0, 0) : body.velocity,
            body.fixed ? Vector3d(0, 0, 0) : body.angular_velocity};
}

}  // namespace

std::vector<RigidState> rigid_states(const sim::World& world) {
    std::vector<RigidState> all;
    for (int i = 0; i < world.bodies(); ++i) {
        const sim::WorldBodyState s = world.state(i);
        const Vector3d own = s.orientation.conjugate() * s.angular_momentum;
        const Vector3d spin = own.cwiseQuotient(world.rigid_mass(i).inertia);
        all.push_back({s.position, s.orientation, s.velocity, s.orientation * spin});
    }
    return all;
}

const std::vector<HardScene>& hard_scenes() {
    // The limits are those of each scene's head.
    static const std::vector<HardScene> kScenes = {{"table", Right::lands, 5.0 / 80, 0.06},
                                                   {"ghost", Right::flies, 1e-4},
                                                   {"card_through_wall", Right::stops, 0.1, -0.03},
                                                   {"boxes_1cm", Right::rests, 0.01},
                                                   {"stack10_10cm", Right::rests, 0.01},
                                                   {"stack15", Right::rests, 0.01},
                                                   {"ratio1000", Right::rests, 0.1},
                                                   {"modal_ball_rolls", Right::rolls, 0.01},
                                                   {"beads", Right::gains_none, 1e-3},
                                                   {"chain20", Right::gains_none, 1e-3},
                                                   {"double_pendulum", Right::keeps_energy, 1e-3},
                                                   {"top", Right::keeps_energy, 1e-3}};
    return kScenes;
}

HardWatch::HardWatch(const sim::WorldDefinition& world, const HardScene& scene)
    : world_(world), scene_(scene), joined_(world.bodies.size() * world.bodies.size()) {
    size_ = std::numeric_limits<double>::infinity();
    for (const sim::WorldBody& body : world.bodies) {
        masses_.push_back(sim::rigid_mass(body.shape.base, body.material));
        start_.push_back(state_at_start(body));
        if (!body.fixed) size_ = std::min(size_, 2 * body.shape.base.semi_axes.maxCoeff());
    }
    before_ = start_;
    through_ = thrown_ = away_ = std::vector<bool>(start_.size());
    for (const sim::PointConstraint& c : world.constraints)
        if (c.body_b >= 0)
            for (const auto& [a, b] : {std::pair(c.body_a, c.body_b), std::pair(c.body_b, c.body_a)})
                joined_[std::size_t(a) * start_.size() + std::size_t(b)] = true;
    energy_ = energy_of(start_);
    const double g = world.settings.gravity.norm();
    for (std::size_t i = 0; i < start_.size(); ++i)
        if (moves(i)) scale_ += masses_[i].mass * g * reach(i);
    const double potential = energy_of([this] {
        std::vector<RigidState> still = start_;
        for (RigidState& s : still) s.velocity.setZero(), s.angular_velocity.setZero();
        return still;
    }());
    scale_ += energy_ - potential;
}

double HardWatch::reach(std::size_t body) const {
    const Vector3d& at = start_[body].position;
    for (const sim::PointConstraint& c : world_.constraints)
        if (c.body_b < 0) return (at - c.point_b).norm();
    double height = 2 * world_.bodies[body].shape.base.semi_axes.maxCoeff();
    for (const sim::WorldPlane& plane : world_.planes)
        height = std::max(height, plane.normal.dot(at) - plane.offset);
    return height;
}

double HardWatch::energy_of(const std::vector<RigidState>& states) const {
    double energy = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (!moves(i)) continue;
        const RigidState& s = states[i];
        const Vector3d spin = s.orientation.conjugate() * s.angular_velocity;
        energy += masses_[i].mass / 2 * s.velocity.squaredNorm() +
                  masses_[i].inertia.dot(spin.cwiseAbs2()) / 2 -
                  masses_[i].mass * world_.bodies[i].gravity_scale * world_.settings.gravity.dot(s.position);
    }
    return energy;
}

/// How deep two bodies are in each other along the direction in which that is least [m]; below 0: not.
double HardWatch::depth(std::size_t a, std::size_t b, const std::vector<RigidState>& s) const {
    const sim::WorldBody &body_a = world_.bodies[a], &body_b = world_.bodies[b];
    const Vector3d between = s[b].position - s[a].position;
    if (is_sphere(body_a) && is_sphere(body_b))
        return body_a.shape.base.semi_axes.x() + body_b.shape.base.semi_axes.x() - between.norm();
    if (is_sphere(body_a))
        return sphere_in_box(s[b].orientation.conjugate() * -between, body_a.shape.base.semi_axes.x(),
                             body_b.shape.base.semi_axes);
    if (is_sphere(body_b)) return depth(b, a, s);
    // Separating axes of two boxes: their faces' normals and the products of their edges.
    const Eigen::Matrix3d ra = s[a].orientation.toRotationMatrix(), rb = s[b].orientation.toRotationMatrix();
    double least = std::numeric_limits<double>::infinity();
    const auto try_axis = [&](const Vector3d& axis) {
        const double length = axis.norm();
        if (length < 1e-6) return;
        const Vector3d n = axis / length;
        least = std::min(
            least, half_width(body_a, s[a], n) + half_width(body_b, s[b], n) - std::abs(n.dot(between)));
    };
    for (int i = 0; i < 3; ++i) {
        try_axis(ra.col(i)), try_axis(rb.col(i));
        for (int j = 0; j < 3; ++j) try_axis(ra.col(i).cross(rb.col(j)));
    }
    return least;
}

void HardWatch::find_penetration(const std::vector<RigidState>& states) {
    double deepest = 0;
    for (std::size_t a = 0; a < states.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b)
            if ((moves(a) || moves(b)) && !joined_[a * states.size() + b])
                deepest = std::max(deepest, depth(a, b, states));
        for (const sim::WorldPlane& plane : world_.planes)
            if (moves(a))
                deepest = std::max(deepest, half_width(world_.bodies[a], states[a], plane.normal) +
                                                plane.offset - plane.normal.dot(states[a].position));
    }
    seen_.penetration_at_end = deepest / size_;
    seen_.penetration = std::max(seen_.penetration, deepest / size_);
}

void HardWatch::find_through(const std::vector<RigidState>& states, double dt) {
    for (std::size_t a = 0; a < states.size(); ++a) {
        if (!moves(a)) continue;
        for (const sim::WorldPlane& plane : world_.planes)
            if (plane.normal.dot(states[a].position) < plane.offset) through_[a] = true;
        for (std::size_t b = 0; b < states.size(); ++b) {
            if (a == b || joined_[a * states.size() + b]) continue;
            if (crosses_core(world_.bodies[b], seen_from(before_[b], before_[a].position),
                             seen_from(states[b], states[a].position)) &&
                crosses_between(world_.bodies[b], {before_[a], states[a]}, {before_[b], states[b]}, dt))
                through_[a] = true;
        }
    }
}

void HardWatch::find_gaps(const std::vector<RigidState>& states) {
    const auto point = [&](int body, const Vector3d& at) {
        const RigidState& s = states[static_cast<std::size_t>(body)];
        return Vector3d(s.position + s.orientation * at);
    };
    for (const sim::PointConstraint& c : world_.constraints) {
        const Vector3d other = c.body_b < 0 ? c.point_b : point(c.body_b, c.point_b);
        seen_.joint_gap =
            std::max(seen_.joint_gap.value_or(0), (point(c.body_a, c.point_a) - other).norm() / size_);
    }
}

/// Where a body belongs now; of what is not said of its place, as it is.
Vector3d HardWatch::place(std::size_t body) const {
    const RigidState &first = start_[body], &now = before_[body];
    switch (scene_.right) {
        case Right::rests:
            return first.position;
        case Right::lands:
            return {now.position.x(), scene_.value, now.position.z()};
        case Right::flies:
            return first.position + time_s_ * first.velocity;
        case Right::stops:
            return {scene_.value, first.position.y(), first.position.z()};
        case Right::rolls:
        case Right::keeps_energy:
        case Right::gains_none:
            break;
    }
    return now.position;
}

void HardWatch::find_drift(const std::vector<RigidState>& states) {
    if (scene_.right == Right::rolls) {
        const Vector3d& n = world_.planes.front().normal;
        const Vector3d down = world_.settings.gravity - n.dot(world_.settings.gravity) * n;
        const double way = 5.0 / 7 * down.norm() * time_s_ * time_s_ / 2;
        rolled_ = std::abs((states[0].position - start_[0].position).dot(down.normalized()) - way) / way;
        return;
    }
    if (scene_.right == Right::keeps_energy || scene_.right == Right::gains_none) return;
    const bool at_end = scene_.right == Right::lands || scene_.right == Right::stops;
    double largest = at_end ? 0 : seen_.drift.value_or(0);
    for (std::size_t i = 0; i < states.size(); ++i) {
        if (!moves(i)) continue;
        const double away = (states[i].position - place(i)).norm() / size_;
        away_[i] = away > 1;
        largest = std::max(largest, away);
    }
    seen_.drift = largest;
}

bool HardWatch::look(double time_s, const std::vector<RigidState>& states, std::optional<double> energy) {
    for (std::size_t i = 0; i < states.size(); ++i) lost_ += moves(i) && !is_fair(states[i]);
    if (lost_ > 0) return false;
    find_through(states, time_s - std::exchange(time_s_, time_s));
    before_ = states;
    find_penetration(states);
    find_gaps(states);
    find_drift(states);
    const double change = (energy.value_or(energy_of(states)) - energy_) / scale_;
    seen_.energy_gained = std::max(seen_.energy_gained, change);
    departure_ = std::max(departure_, std::abs(change));
    for (std::size_t i = 0; i < states.size(); ++i)
        if (moves(i) && masses_[i].mass / 2 * states[i].velocity.squaredNorm() > kFaster * scale_)
            thrown_[i] = true;
    return true;
}

HardFigures HardWatch::figures(int quarantined) const {
    HardFigures f = seen_;
    f.quarantined = std::max(quarantined, lost_);
    f.through = static_cast<int>(std::count(through_.begin(), through_.end(), true));
    for (std::size_t i = 0; i < thrown_.size(); ++i) f.thrown += !through_[i] && (thrown_[i] || away_[i]);
    f.error = scene_.right == Right::rolls ? rolled_ : f.drift.value_or(departure_);
    if (f.quarantined > 0) f.error = std::numeric_limits<double>::infinity();
    const double judged = scene_.right == Right::gains_none ? f.energy_gained : f.error;
    f.right = judged <= scene_.limit && f.quarantined + f.through + f.thrown == 0;
    return f;
}

}  // namespace app
