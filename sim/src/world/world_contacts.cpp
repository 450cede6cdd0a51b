#include "world/world_contacts.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace sim {
namespace {

constexpr double kSlop = 0.005;  // of the smaller half extent: contacts exist from here on
constexpr float kDeep = 0.04f;   // of it: a contact that begins deeper is one of bodies put inside each other
// A body is in another if its centre is, or is nearer to it than this share of its own smallest half extent.
constexpr double kBuried = 0.2;
constexpr std::uint32_t kParting = 0x7ffffffe;  // feature of the one contact of bodies inside each other
constexpr std::uint32_t kFoot = 0x7fffffff;     // feature of a body's lowest point over a plane
constexpr float kManifoldTolerance = 0.02f;
constexpr std::uint32_t kOfB = 1u << 31;  // feature: a sample of b

double smallest_half(const MovingBody& body) {
    return body.kind->definition.shape.base.semi_axes.minCoeff();
}

// How far any point may come in a step, against things at rest.
double reach_of(const MovingBody& body, double speed, const WorldSettings& settings) {
    if (!body.moves() || body.asleep) return 0;
    return settings.dt * (speed + settings.dt * std::abs(body.gravity_scale) * settings.gravity.norm());
}

// All that can be closed within the step, so that nothing passes through unseen.
double margin_of(double approach, double size, const WorldSettings& settings) {
    return kSlop * size + std::max(approach, 0.0) * settings.dt;
}

bool is_buried(const PosedBody& body, const PosedBody& in) {
    const Eigen::Vector3d centre = in.rotation.transpose() * (body.position - in.position);
    return in.kind->surface.distance(centre).distance <
           kBuried * body.kind->definition.shape.base.semi_axes.minCoeff();
}

void finish(const Manifold* before, float size, Manifold& manifold) {
    if (manifold.count == 0) return;
    const float deepest = -manifold.points[0].separation;
    manifold.emerging = before ? before->emerging && deepest > 0.01f * size : deepest > kDeep * size;
    if (before) take_impulses(*before, 0.1f * size, manifold);
}

}  // namespace

double contact_reach(const MovingBody& body, const WorldSettings& settings) {
    return kSlop * smallest_half(body) + reach_of(body, point_speed(body), settings);
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

void WorldContacts::find(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                         const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies,
                         const std::vector<int>& here, bool among_ghosts) {
    among_ghosts_ = among_ghosts;
    std::swap(before_, manifolds_);
    speeds_.resize(bodies.size());
    while (find_once(settings, planes, joined, bodies, here)) {
    }
}

bool WorldContacts::find_once(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                              const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies,
                              const std::vector<int>& here) {
    manifolds_.clear();
    pairs_ = 0;
    next_before_ = 0;
    woke_ = false;
    auto& boxes = broad_.boxes();
    boxes.clear();
    for (const int id : here) {
        const auto i = static_cast<std::size_t>(id);
        const MovingBody& body = bodies[i];
        const double speed = point_speed(body);
        speeds_[i] = {speed - body.state.velocity.norm(),
                      kSlop * smallest_half(body) + reach_of(body, speed, settings)};
        const Eigen::Vector3d half = body.posed.half_aabb.array() + speeds_[i].grown;
        boxes.push_back(
            {body.posed.position - half, body.posed.position + half, id, body.moves() && !body.asleep});
    }
    // By bodies, each with later bodies and then with planes: in the order of the manifolds' keys.
    const auto& pairs = broad_.find();
    auto pair = pairs.begin();
    for (const int i : here) {
        for (; pair != pairs.end() && pair->first == i; ++pair)
            if ((joined.empty() || !std::binary_search(joined.begin(), joined.end(), *pair)) &&
                resolved_here(bodies, i, pair->second))
                meet_pair(settings, bodies, i, pair->second);
        if (!woke_) meet_planes(settings, planes, bodies[static_cast<std::size_t>(i)], i);
    }
    return woke_;
}

// Among ghosts: of an own and a ghost body, those whose lower number is own; a ghost's with what is fixed.
bool WorldContacts::resolved_here(const std::vector<MovingBody>& bodies, int i, int j) const {
    if (!among_ghosts_) return true;
    const MovingBody &a = bodies[static_cast<std::size_t>(i)], &b = bodies[static_cast<std::size_t>(j)];
    return a.own || !a.moves() || !b.moves();
}

// Keys must ascend from call to call.
const Manifold* WorldContacts::last(std::uint64_t key) {
    while (next_before_ < before_.size() && before_[next_before_].key() < key) ++next_before_;
    return next_before_ < before_.size() && before_[next_before_].key() == key ? &before_[next_before_]
                                                                               : nullptr;
}

void WorldContacts::meet_pair(const WorldSettings& settings, std::vector<MovingBody>& bodies, int i, int j) {
    const MovingBody &a = bodies[static_cast<std::size_t>(i)], &b = bodies[static_cast<std::size_t>(j)];
    ++pairs_;
    const Eigen::Vector3d apart = a.posed.position - b.posed.position;
    const double distance = apart.norm(), size = std::min(smallest_half(a), smallest_half(b));
    // Speed at which the gap can close: of the centres along their line, and of the surfaces about them.
    const Eigen::Vector3d closing = b.state.velocity - a.state.velocity;
    double approach = distance > 1e-9 ? closing.dot(apart) / distance : closing.norm();
    approach += speeds_[static_cast<std::size_t>(i)].surface + speeds_[static_cast<std::size_t>(j)].surface;
    const float margin = static_cast<float>(margin_of(approach, size, settings));
    if (distance > a.posed.radius + b.posed.radius + margin) return;
    Manifold& manifold = manifolds_.emplace_back();
    manifold.a = i, manifold.b = j;
    meet(a, b, margin, manifold);
    if (manifold.count == 0) {
        manifolds_.pop_back();
        return;
    }
    manifold.friction = std::sqrt(a.friction * b.friction);
    manifold.restitution = std::max(a.restitution, b.restitution);
    if (a.asleep || b.asleep) {
        wake_group(bodies, a.asleep ? i : j);
        woke_ = true;
    }
}

void WorldContacts::meet_planes(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                                const MovingBody& body, int i) {
    if (!body.moves() || body.asleep) return;
    const Speed& speed = speeds_[static_cast<std::size_t>(i)];
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const WorldPlane& plane = planes[p];
        const double height = plane.normal.dot(body.posed.position) - plane.offset;
        if (height > plane.normal.cwiseAbs().dot(body.posed.half_aabb) + speed.grown) continue;
        ++pairs_;
        const double approach = -plane.normal.dot(body.state.velocity) + speed.surface;
        Manifold& manifold = manifolds_.emplace_back();
        manifold.a = i, manifold.b = kFirstPlane + static_cast<int>(p);
        meet_plane(body, plane, static_cast<float>(height),
                   static_cast<float>(margin_of(approach, smallest_half(body), settings)), manifold);
        if (manifold.count == 0) {
            manifolds_.pop_back();
            continue;
        }
        manifold.friction = std::sqrt(body.friction * static_cast<float>(plane.friction));
        manifold.restitution = std::max(body.restitution, static_cast<float>(plane.restitution));
    }
}

void WorldContacts::meet(const MovingBody& a, const MovingBody& b, float margin, Manifold& manifold) {
    const PosedBody &pa = a.posed, &pb = b.posed;
    const float size = static_cast<float>(std::min(smallest_half(a), smallest_half(b)));
    found_.clear();
    finder_.find(pa, pb, margin, found_);
    const std::size_t of_a = found_.size();
    finder_.find(pb, pa, margin, found_);
    float lowest = 1e30f;
    for (const SampleContact& contact : found_) lowest = std::min(lowest, contact.separation);
    const float out = PointChooser::reach(lowest, kManifoldTolerance * size);
    const Eigen::Vector3f between = (pa.position - pb.position).cast<float>();
    const Manifold* before = last(manifold.key());
    // Among ghosts a body that was put right may find itself inside another at any time.
    if (lowest < 0 && (!before || before->emerging || among_ghosts_) &&
        (is_buried(pa, pb) || is_buried(pb, pa)))
        return part(pa, pb, between, before, manifold);
    candidates_.clear();
    for (const bool b_sampled : {false, true}) {
        const PosedBody &sampled = b_sampled ? pb : pa, &implicit = b_sampled ? pa : pb;
        const Eigen::Matrix3f turn = implicit.rotation.cast<float>(),
                              turn_sampled = sampled.rotation.cast<float>();
        for (std::size_t i = b_sampled ? of_a : 0; i < (b_sampled ? found_.size() : of_a); ++i) {
            const SampleContact& contact = found_[i];
            if (contact.separation > out) continue;
            ContactCandidate& point = candidates_.emplace_back();
            const Eigen::Vector3f normal = turn * contact.normal;
            const Eigen::Vector3f arm =
                turn_sampled * sampled.sample(contact.sample) - 0.5f * contact.separation * normal;
            point.feature = static_cast<std::uint32_t>(contact.sample) | (b_sampled ? kOfB : 0u);
            point.separation = contact.separation;
            point.rest = contact.rest;
            point.normal = b_sampled ? Eigen::Vector3f(-normal) : normal;
            point.arm_a = b_sampled ? Eigen::Vector3f(arm - between) : arm;
        }
    }
    fill(size, between, manifold);
}

void WorldContacts::meet_plane(const MovingBody& a, const WorldPlane& plane, float height, float margin,
                               Manifold& manifold) {
    const PosedBody& posed = a.posed;
    const Eigen::Vector3f n = (posed.rotation.transpose() * plane.normal).cast<float>();
    const float* x = posed.sample_data();
    const int stride = posed.kind->batches * kLanes;
    const Eigen::Matrix3f turn = posed.rotation.cast<float>();
    const Eigen::Vector3f normal = plane.normal.cast<float>();
    const float size = static_cast<float>(smallest_half(a)), tolerance = kManifoldTolerance * size;
    candidates_.clear();
    float lowest = margin;
    // An ellipsoid touches a plane with its lowest point: it rolls as round as it is. Modes may dent it, so
    // modal ones have their samples besides.
    const bool modal = posed.kind->modes > 0 && !posed.kind->linear();
    if (posed.kind->ellipsoid) {
        ContactCandidate foot;
        foot.feature = kFoot;
        foot.rest = posed.furthest_rest_point(-n);
        const Eigen::Vector3f place = turn * posed.deformed(foot.rest.cast<double>()).cast<float>();
        foot.separation = normal.dot(place) + height;
        foot.normal = normal;
        foot.arm_a = place - 0.5f * foot.separation * normal;
        if (foot.separation < margin) candidates_.push_back(foot);
    }
    for (int first = 0; first < (posed.kind->ellipsoid && !modal ? 0 : stride); first += kLanes) {
        const Lanes s = n.x() * load_lanes(x + first) + n.y() * load_lanes(x + stride + first) +
                        n.z() * load_lanes(x + 2 * stride + first) + height;
        const float out = std::min(margin, PointChooser::reach(lowest, tolerance));
        for (unsigned left = bits_of(s < out); left != 0; left &= left - 1) {
            const int lane = std::countr_zero(left);
            if (first + lane >= posed.kind->samples) break;
            lowest = std::min(lowest, s[lane]);
            ContactCandidate& point = candidates_.emplace_back();
            point.feature = static_cast<std::uint32_t>(first + lane);
            point.separation = s[lane];
            point.normal = normal;
            point.arm_a = turn * posed.sample(first + lane) - 0.5f * s[lane] * normal;
            point.rest.setZero();
        }
    }
    fill(size, Eigen::Vector3f::Zero(), manifold);
}

// Bodies put so deep into each other that surface samples no longer tell which way is out: one contact along
// the line of the centres (straight up where they coincide), as deep as the bodies overlap along it.
void WorldContacts::part(const PosedBody& a, const PosedBody& b, const Eigen::Vector3f& between,
                         const Manifold* before, Manifold& manifold) {
    ManifoldPoint& point = manifold.points[0];
    manifold.count = 1;
    const float distance = between.norm();
    point.normal =
        distance > 1e-6f * a.radius ? Eigen::Vector3f(between / distance) : Eigen::Vector3f::UnitY();
    const auto [sample_a, reach_a] =
        a.furthest_sample(-(a.rotation.transpose().cast<float>() * point.normal));
    const auto [sample_b, reach_b] = b.furthest_sample(b.rotation.transpose().cast<float>() * point.normal);
    point.feature = kParting;
    point.separation = distance - reach_a - reach_b;
    point.arm_a = (-reach_a - 0.5f * point.separation) * point.normal;
    point.arm_b = point.arm_a + between;
    point.rest.setZero();
    point.sample_a = sample_a, point.sample_b = sample_b;
    manifold.emerging = true;
    if (before) take_impulses(*before, a.radius, manifold);
}

// The manifold's points out of the candidates, with the impulses of the step before. between: from b's centre
// to a's.
void WorldContacts::fill(float size, const Eigen::Vector3f& between, Manifold& manifold) {
    if (candidates_.empty()) return;
    const Manifold* before = last(manifold.key());
    std::array<int, kManifoldPoints> chosen;
    manifold.count = chooser_.choose(candidates_, kManifoldTolerance * size, before, chosen);
    for (std::size_t i = 0; i < static_cast<std::size_t>(manifold.count); ++i) {
        const ContactCandidate& from = candidates_[static_cast<std::size_t>(chosen[i])];
        ManifoldPoint& point = manifold.points[i];
        point.feature = from.feature;
        point.separation = from.separation;
        point.normal = from.normal;
        point.arm_a = from.arm_a;
        if (manifold.b >= kFirstPlane) {
            point.arm_b.setZero();
        } else {
            point.arm_b = from.arm_a + between;
        }
        point.rest = from.rest;
        const int sample = static_cast<int>(from.feature & ~kOfB);
        if (from.feature != kFoot) (from.feature & kOfB ? point.sample_b : point.sample_a) = sample;
    }
    finish(before, size, manifold);
}

}  // namespace sim
