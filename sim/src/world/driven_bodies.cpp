#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

// Bodies that move as prescribed. Where they are is a function of time alone, so every world that holds them knows it.

namespace sim {
namespace {

auto key_after(const std::vector<MotionKey>& motion, double time_s) {
    return std::upper_bound(motion.begin(), motion.end(), time_s,
                            [](double time, const MotionKey& key) { return time < key.time_s; });
}

Eigen::Vector3d spin_between(const MotionKey& from, const MotionKey& to) {
    const Eigen::AngleAxisd turn(to.orientation * from.orientation.conjugate());
    // Eigen's angle is from 0 to pi: the shorter way.
    return turn.angle() / (to.time_s - from.time_s) * turn.axis();
}

Eigen::Quaterniond turned(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& by) {
    const double angle = by.norm();
    return angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, by / angle)) * orientation : orientation;
}

}  // namespace

BodyPath::Pose pose_at(const std::vector<MotionKey>& motion, double time_s) {
    const auto next = key_after(motion, time_s);
    if (next == motion.begin()) return {next->position, next->orientation};
    const MotionKey& from = *std::prev(next);
    if (next == motion.end()) return {from.position, from.orientation};
    const double gone = time_s - from.time_s;
    return {from.position + gone / (next->time_s - from.time_s) * (next->position - from.position),
            turned(from.orientation, gone * spin_between(from, *next)).normalized()};
}

void follow_motion(const std::vector<MotionKey>& motion, double begins_s, double dt, BodyPath& path) {
    path.legs.clear();
    path.end = dt;
    path.inertia.setOnes();  // its momentum is its spin, which stays
    auto next = key_after(motion, begins_s);
    for (double time = 0; time < dt;) {
        const BodyPath::Pose pose = pose_at(motion, begins_s + time);
        BodyPath::Leg& leg = path.legs.emplace_back();
        leg.start = time, leg.position = pose.position, leg.orientation = pose.orientation;
        if (next != motion.begin() && next != motion.end()) {
            const MotionKey& from = *std::prev(next);
            leg.velocity = (next->position - from.position) / (next->time_s - from.time_s);
            leg.momentum = leg.spin = spin_between(from, *next);
        }
        if (next == motion.end()) return;
        time = next->time_s - begins_s;
        ++next;
    }
}

// At the end of a step, or the start, with the velocity that it came with.
void World::Implementation::place_driven(MovingBody& body) {
    const double time = static_cast<double>(counts.steps) * settings.dt;
    const auto next = std::lower_bound(body.motion.begin(), body.motion.end(), time,
                                       [](const MotionKey& key, double t) { return key.time_s < t; });
    const BodyPath::Pose now = pose_at(body.motion, time);
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero(), spin = velocity;
    if (next != body.motion.begin() && next != body.motion.end()) {
        velocity = (next->position - std::prev(next)->position) / (next->time_s - std::prev(next)->time_s);
        spin = spin_between(*std::prev(next), *next);
    }
    set_driven(body, now, velocity, spin);
}

void World::Implementation::set_driven(MovingBody& body, const BodyPath::Pose& now,
                                       const Eigen::Vector3d& velocity, const Eigen::Vector3d& spin) {
    WorldBodyState& s = body.state;
    s.position = now.position, s.orientation = now.orientation, s.velocity = velocity;
    const Eigen::Matrix3d r = s.orientation.toRotationMatrix();
    s.angular_momentum = r * body.kind->mass.inertia.cwiseProduct(r.transpose() * spin);
    pose(body);
}

// Before a step: their paths, and who is woken by joints.
void World::Implementation::begin_motions() {
    contacts.paths().resize(bodies.size());
    const double begins = static_cast<double>(counts.steps - 1) * settings.dt;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        MovingBody& body = bodies[i];
        if (body.motion.empty()) continue;
        BodyPath& path = contacts.paths()[i];
        follow_motion(body.motion, begins, settings.dt, path);
        const BodyPath::Leg& first = path.legs.front();
        set_driven(body, {first.position, first.orientation}, first.velocity, first.spin);
        body.travels = std::ranges::any_of(path.legs, [](const BodyPath::Leg& leg) {
            return !leg.velocity.isZero(0) || !leg.spin.isZero(0);
        });
    }
    for (const HeldConstraint& c : constraints) {
        const int a = c.definition.body_a, b = c.definition.body_b;
        if (!c.holds || b < 0) continue;
        for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)})
            if (bodies[static_cast<std::size_t>(one)].travels &&
                bodies[static_cast<std::size_t>(other)].asleep)
                wake_group(bodies, other);
    }
}

void World::Implementation::end_motions() {
    for (MovingBody& body : bodies)
        if (!body.motion.empty()) place_driven(body);
}

bool IslandSolver::is_carried(const Island& island) const {
    auto travels = [this](int id) {
        return id >= 0 && id < kFirstPlane && (*bodies_)[static_cast<std::size_t>(id)].travels;
    };
    return std::ranges::any_of(island.manifolds,
                               [&](int m) {
                                   const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
                                   return travels(manifold.a) || travels(manifold.b);
                               }) ||
           std::ranges::any_of(island.constraints, [&](int c) {
               const PointConstraint& held = (*constraints_)[static_cast<std::size_t>(c)].definition;
               return travels(held.body_a) || travels(held.body_b);
           });
}

// Where a body that the island does not move is, and how.
BodyPath::Pose IslandSolver::pose_of(int body, double time) const {
    const MovingBody& b = (*bodies_)[static_cast<std::size_t>(body)];
    if (b.travels) return (*paths_)[static_cast<std::size_t>(body)].at(time);
    return {b.state.position, b.state.orientation};
}

// Speed of its matter at a place, mean over the substep.
Eigen::Vector3d IslandSolver::speed_of(int body, const Eigen::Vector3d& arm) const {
    if (body < 0 || body >= kFirstPlane || !(*bodies_)[static_cast<std::size_t>(body)].travels)
        return Eigen::Vector3d::Zero();
    const BodyPath::Pose from = pose_of(body, time_), to = pose_of(body, time_ + h_);
    const Eigen::AngleAxisd turn(to.orientation * from.orientation.conjugate());
    return (to.position - from.position + turn.angle() * turn.axis().cross(arm)) / h_;
}

// What the rows of a contact see of bodies that move as prescribed.
void IslandSolver::see_driven(ContactRows& c) const {
    const int a = c.manifold->a, b = c.manifold->b;
    const bool any = (*bodies_)[static_cast<std::size_t>(a)].travels ||
                     (b < kFirstPlane && (*bodies_)[static_cast<std::size_t>(b)].travels);
    if (!any) return;
    const Eigen::Vector3d place = place_now(c);
    const int driven = c.side[0].body < 0 ? a : b;
    const Eigen::Vector3d v = speed_of(driven, place - pose_of(driven, now_).position);
    const Eigen::Vector3f seen = (driven == a ? v : Eigen::Vector3d(-v)).cast<float>();
    c.drift = {c.point->normal.dot(seen), c.tangent[0].dot(seen), c.tangent[1].dot(seen)};
}

}  // namespace sim
