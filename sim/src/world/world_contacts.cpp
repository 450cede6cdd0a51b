#include "world/world_contacts.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// How far the normal of a pair may turn until it touches; a rebound turns by twice that. Bent bodies touch with
// several samples, whose normals differ by more.
constexpr double kNormalTurn = 0.004, kBentNormalTurn = 0.05;  // [rad]

double smallest_half(const MovingBody& body) {
    return sim::smallest_half(body.posed);
}

// Acceleration of free motion.
Eigen::Vector3d pull_on(const MovingBody& body, const WorldSettings& settings) {
    Eigen::Vector3d pull = body.gravity_scale * settings.gravity;
    if (body.pushed) pull += body.force / body.kind->mass.mass;
    return pull;
}

// Speed of a body's surface by its modes, at most.
double ringing_speed(const MovingBody& body) {
    double speed = 0;
    for (int k = 0; k < body.kind->modes; ++k)
        speed += std::abs(body.state.q_dot[k]) * body.kind->shape_bound[k];
    return speed;
}

bool carries(const Manifold& manifold) {
    const auto end = manifold.points.begin() + manifold.count;
    return std::any_of(manifold.points.begin(), end,
                       [](const ManifoldPoint& p) { return p.normal_impulse > 0; });
}

// The least separation of a contact's points when free motion ends, as its half-spaces tell [m].
double separation_after(const Manifold& manifold, const MovingBody& a, const MovingBody& b,
                        const Eigen::Vector3d& moved, double dt) {
    double least = 1e300;
    const Eigen::Vector3d spin_a = spin_of(a, a.state.orientation, a.state.angular_momentum),
                          spin_b = spin_of(b, b.state.orientation, b.state.angular_momentum);
    for (int i = 0; i < manifold.count; ++i) {
        const ManifoldPoint& p = manifold.points[static_cast<std::size_t>(i)];
        const Eigen::Vector3d turned =
            spin_a.cross(p.arm_a.cast<double>()) - spin_b.cross(p.arm_b.cast<double>());
        least = std::min(
            least, static_cast<double>(p.separation) + p.normal.cast<double>().dot(moved + dt * turned));
    }
    return least;
}

// Whether the normal of a contact of two ellipsoids stands still until they touch.
bool keeps_normal(const Manifold& manifold, const MovingBody& a, const MovingBody& b,
                  const Eigen::Vector3d& moved, double turned) {
    if (!a.kind->ellipsoid || !b.kind->ellipsoid) return false;
    const Eigen::Vector3d n = manifold.points[0].normal.cast<double>();
    const double aside = (moved - n.dot(moved) * n).norm() + turned;
    const double most = is_round(a.posed) && is_round(b.posed) ? kNormalTurn : kBentNormalTurn;
    return aside < most * (smallest_radius(*a.kind) + smallest_radius(*b.kind));
}

}  // namespace

double turning_speed(const MovingBody& body) noexcept {
    if (!body.moves() || body.asleep) return 0;
    return body.state.angular_momentum.norm() / body.kind->mass.inertia.minCoeff() *
           turn_reach_of(*body.kind);
}

double contact_reach(const MovingBody& body, const WorldSettings& settings) {
    const double slop = kSlop * smallest_half(body);
    if (body.travels) return slop + settings.dt * point_speed(body);
    if (!body.moves() || body.asleep) return slop;
    return slop + settings.dt * (point_speed(body) + settings.dt * pull_on(body, settings).norm());
}

void wake_group(std::vector<MovingBody>& bodies, int body) {
    const int group = bodies[static_cast<std::size_t>(body)].sleep_group;
    for (MovingBody& other : bodies) {
        if (!other.asleep ||
            (other.sleep_group != group && &other != &bodies[static_cast<std::size_t>(body)]))
            continue;
        other.asleep = false;
        other.still_steps = 0;
    }
}

void WorldContacts::find(const ContactScene& scene) {
    std::swap(before_, manifolds_);
    reach_.resize(scene.bodies.size());
    paths_.resize(scene.bodies.size());
    first_.resize(scene.bodies.size());
    known_.clear();
    while (find_once(scene)) {
    }
}

void WorldContacts::set_reach(const ContactScene& scene, int id) {
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
    Reach& reach = reach_[static_cast<std::size_t>(id)];
    reach = {};
    if (body.travels) {
        const BodyPath& path = paths_[static_cast<std::size_t>(id)];
        reach.moved = path.until(path.end).moved;
        reach.rung = -reach.moved.norm();  // by how much its way is longer
        for (std::size_t i = 0; i < path.legs.size(); ++i)
            reach.rung += (path.end_of(i) - path.legs[i].start) * path.legs[i].velocity.norm();
        for (std::size_t i = 0; i < path.legs.size(); ++i)
            reach.turned +=
                (path.end_of(i) - path.legs[i].start) * path.legs[i].spin.norm() * turn_reach_of(*body.kind);
        return;
    }
    if (!body.moves() || body.asleep) return;
    const double dt = scene.settings.dt;
    reach.moved = dt * (body.state.velocity + dt * pull_on(body, scene.settings));
    reach.turned = dt * turning_speed(body);
    reach.rung = dt * ringing_speed(body);
}

bool WorldContacts::find_once(const ContactScene& scene) {
    manifolds_.clear(), meetings_.clear();
    followed_.assign(scene.bodies.size(), false);
    watched_.assign(scene.bodies.size(), false);
    pairs_ = 0;
    next_before_ = 0;
    woke_ = false;
    auto& boxes = broad_.boxes();
    boxes.clear();
    for (const int id : scene.here) {
        const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
        set_reach(scene, id);
        const Reach& reach = reach_[static_cast<std::size_t>(id)];
        const Eigen::Vector3d half =
            body.posed.half_aabb.array() + reach.turned + reach.rung + kSlop * smallest_half(body);
        const Eigen::Vector3d &from = body.posed.position, to = from + reach.moved;
        boxes.push_back({from.cwiseMin(to) - half, from.cwiseMax(to) + half, id,
                         body.travels || (body.moves() && !body.asleep)});
    }
    // By bodies, each with later bodies and then with planes: in the order of the manifolds' keys.
    const auto& pairs = broad_.find();
    auto pair = pairs.begin();
    for (const int i : scene.here) {
        for (; pair != pairs.end() && pair->first == i; ++pair)
            if (scene.may_meet(*pair)) meet_pair(scene, i, pair->second);
        if (!woke_) meet_planes(scene, i);
    }
    if (!woke_ && !meetings_.empty()) accept_impacts(scene);
    return woke_;
}

// Among ghosts: of an own and a ghost body, those whose lower number is own; a ghost's with what is fixed.
bool ContactScene::may_meet(const std::pair<int, int>& pair) const {
    if (!joined.empty() && std::binary_search(joined.begin(), joined.end(), pair)) return false;
    const MovingBody &a = bodies[static_cast<std::size_t>(pair.first)],
                     &b = bodies[static_cast<std::size_t>(pair.second)];
    if (!a.moves() && !b.moves()) return false;
    if (!among_ghosts) return true;
    return a.own || !a.moves() || !b.moves();
}

void ContactScene::set_surface(Manifold& manifold) const {
    const MovingBody& a = bodies[static_cast<std::size_t>(manifold.a)];
    const bool on_plane = manifold.b >= kFirstPlane;
    const auto b = static_cast<std::size_t>(on_plane ? manifold.b - kFirstPlane : manifold.b);
    const float friction = on_plane ? static_cast<float>(planes[b].friction) : bodies[b].friction,
                restitution = on_plane ? static_cast<float>(planes[b].restitution) : bodies[b].restitution;
    manifold.friction = std::sqrt(a.friction * friction);
    manifold.restitution = std::max(a.restitution, restitution);
}

// Keys must ascend from call to call.
const Manifold* WorldContacts::last(std::uint64_t key) {
    while (next_before_ < before_.size() && before_[next_before_].key() < key) ++next_before_;
    return next_before_ < before_.size() && before_[next_before_].key() == key ? &before_[next_before_]
                                                                               : nullptr;
}

// Whether the balls that hold two bodies pass each other. Paths under gravity bend by g dt^2 / 8.
bool WorldContacts::pass_by(const ContactScene& scene, int i, int j) const {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    const Reach &ra = reach_[static_cast<std::size_t>(i)], &rb = reach_[static_cast<std::size_t>(j)];
    const Eigen::Vector3d apart = a.posed.position - b.posed.position, moved = ra.moved - rb.moved;
    const double length = moved.squaredNorm(), dt = scene.settings.dt;
    const double at = length > 0 ? std::clamp(-apart.dot(moved) / length, 0.0, 1.0) : 0;
    const Eigen::Vector3d bend = pull_on(a, scene.settings) - pull_on(b, scene.settings);
    const double reach = static_cast<double>(a.posed.radius + b.posed.radius) + ra.rung + rb.rung +
                         kSlop * std::min(smallest_half(a), smallest_half(b)) + dt * dt / 8 * bend.norm();
    return (apart + at * moved).squaredNorm() > reach * reach;
}

void WorldContacts::meet_pair(const ContactScene& scene, int i, int j) {
    ++pairs_;
    if (pass_by(scene, i, j)) return;
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    const Reach &ra = reach_[static_cast<std::size_t>(i)], &rb = reach_[static_cast<std::size_t>(j)];
    const double size = std::min(smallest_half(a), smallest_half(b));
    const Eigen::Vector3d moved = ra.moved - rb.moved;
    const double motion = moved.norm() + ra.turned + rb.turned;
    const Manifold* before = last(static_cast<std::uint64_t>(i) << 32 | static_cast<std::uint32_t>(j));
    if (motion > kSlow * size) return meet_fast(scene, i, j, before);
    const std::size_t count = manifolds_.size();
    meet_near(scene, i, j, kSlop * size + motion + ra.rung + rb.rung, before);
    if (manifolds_.size() == count) return;
    if (static_cast<double>(manifolds_.back().points[0].separation) > kTouching * size) {
        const double after = separation_after(manifolds_.back(), a, b, moved, scene.settings.dt);
        if (after > kSlop * size + ra.rung + rb.rung) return manifolds_.pop_back();
        // What would be stopped: where and whether it meets, the paths tell better.
        if (after < 0 && !keeps_normal(manifolds_.back(), a, b, moved, ra.turned + rb.turned)) {
            const Impact impact = foresee(scene, i, j);
            const bool nearest = is_round(a.posed) || is_round(b.posed);
            if (!impact.meets || (nearest && !impact.at_once)) manifolds_.pop_back();
            if (!impact.meets) return;
            if (nearest && !impact.at_once) meetings_.push_back({i, j, impact.time, false});
        }
    }
    wake(scene, i, j);
}

void WorldContacts::meet_near(const ContactScene& scene, int i, int j, double margin,
                              const Manifold* before) {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    Manifold& manifold = manifolds_.emplace_back();
    manifold.a = i, manifold.b = j;
    narrow_.pair(a.posed, b.posed, {static_cast<float>(margin), before, scene.among_ghosts}, manifold);
    if (manifold.count == 0) {
        manifolds_.pop_back();
        return;
    }
    scene.set_surface(manifold);
}

// What carried load a step ago mostly touches still.
void WorldContacts::meet_fast(const ContactScene& scene, int i, int j, const Manifold* before) {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    const double size = std::min(smallest_half(a), smallest_half(b)), margin = (kSlop + kSlow) * size;
    const std::size_t count = manifolds_.size();
    bool touches = false;
    if (before && carries(*before)) {
        meet_near(scene, i, j, margin, before);
        touches = manifolds_.size() > count;
    }
    if (!touches) {
        const Impact impact = foresee(scene, i, j);
        if (!impact.meets) return;
        meetings_.push_back({i, j, impact.time, false});
        return wake(scene, i, j);
    }
    wake(scene, i, j);
    watch_turning(i, j, kSlow * size);
}

// Turning on, other places of a pair that touches may meet, even if this one holds nothing up.
void WorldContacts::watch_turning(int i, int j, double least) {
    if (reach_[static_cast<std::size_t>(i)].turned + reach_[static_cast<std::size_t>(j)].turned > least)
        watched_[static_cast<std::size_t>(i)] = watched_[static_cast<std::size_t>(j)] = true;
}

void WorldContacts::wake(const ContactScene& scene, int i, int j) {
    for (const int id : {i, j}) {
        if (!scene.bodies[static_cast<std::size_t>(id)].asleep) continue;
        wake_group(scene.bodies, id);
        woke_ = true;
    }
}

void WorldContacts::meet_planes(const ContactScene& scene, int i) {
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(i)];
    if (!body.moves() || body.asleep) return;
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    for (std::size_t p = 0; p < scene.planes.size(); ++p) {
        const WorldPlane& plane = scene.planes[p];
        const double height = plane.normal.dot(body.posed.position) - plane.offset;
        const double margin = kSlop * smallest_half(body) + reach.turned + reach.rung +
                              std::max(0.0, -plane.normal.dot(reach.moved));
        if (height > plane.normal.cwiseAbs().dot(body.posed.half_aabb) + margin) continue;
        ++pairs_;
        Manifold& manifold = manifolds_.emplace_back();
        manifold.a = i, manifold.b = kFirstPlane + static_cast<int>(p);
        narrow_.plane(body.posed, plane.normal, static_cast<float>(height), static_cast<float>(margin),
                      last(manifold.key()), manifold);
        if (manifold.count == 0) {
            manifolds_.pop_back();
            continue;
        }
        scene.set_surface(manifold);
    }
}

}  // namespace sim
