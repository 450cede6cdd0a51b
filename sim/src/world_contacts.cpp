#include "world_contacts.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kSlop = 0.005;  // of the smaller half extent: contacts exist from here on
constexpr float kDeep = 0.04f;   // of it: a contact that begins deeper is one of bodies put inside each other
constexpr float kManifoldTolerance = 0.02f;

double smallest_half(const MovingBody& body) {
    return body.kind->definition.shape.base.semi_axes.minCoeff();
}

// How far any point may come in a step, against things at rest.
double reach_of(const MovingBody& body, const WorldSettings& settings) {
    if (!body.moves() || body.asleep) return 0;
    return settings.dt *
           (point_speed(body) + settings.dt * std::abs(body.gravity_scale) * settings.gravity.norm());
}

// All that can be closed within the step, so that nothing passes through unseen.
double margin_of(double approach, double size, const WorldSettings& settings) {
    return kSlop * size + std::max(approach, 0.0) * settings.dt;
}

void finish(const Manifold* before, float size, Manifold& manifold) {
    if (manifold.count == 0) return;
    const float deepest = -manifold.points[0].separation;
    manifold.emerging = before ? before->emerging && deepest > 0.01f * size : deepest > kDeep * size;
    if (before) take_impulses(*before, 0.1f * size, manifold);
}

}  // namespace

void wake_group(std::vector<MovingBody>& bodies, int body) {
    const int group = bodies[static_cast<std::size_t>(body)].sleep_group;
    for (MovingBody& other : bodies) {
        if (!other.asleep ||
            (other.sleep_group != group && &other != &bodies[static_cast<std::size_t>(body)]))
            continue;
        other.asleep = false;
        other.still_s = 0;
    }
}

void WorldContacts::find(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                         const std::vector<std::pair<int, int>>& joined, std::vector<MovingBody>& bodies) {
    std::swap(before_, manifolds_);
    while (find_once(settings, planes, joined, bodies)) {
    }
}

bool WorldContacts::find_once(const WorldSettings& settings, const std::vector<WorldPlane>& planes,
                              const std::vector<std::pair<int, int>>& joined,
                              std::vector<MovingBody>& bodies) {
    manifolds_.clear();
    pairs_ = 0;
    bool woke = false;
    auto& boxes = broad_.boxes();
    boxes.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const MovingBody& body = bodies[i];
        if (body.quarantined) continue;
        const double grown = kSlop * smallest_half(body) + reach_of(body, settings);
        const Eigen::Vector3d half = body.posed.half_aabb.array() + grown;
        boxes.push_back({body.posed.position - half, body.posed.position + half, static_cast<int>(i),
                         body.moves() && !body.asleep});
    }
    auto last = [this](const Manifold& manifold) -> const Manifold* {
        const auto old = std::lower_bound(before_.begin(), before_.end(), manifold.key(),
                                          [](const Manifold& m, std::uint64_t key) { return m.key() < key; });
        return old != before_.end() && old->key() == manifold.key() ? &*old : nullptr;
    };
    for (const auto& [i, j] : broad_.find()) {
        if (std::binary_search(joined.begin(), joined.end(), std::pair(i, j))) continue;
        const MovingBody &a = bodies[static_cast<std::size_t>(i)], &b = bodies[static_cast<std::size_t>(j)];
        Manifold manifold;
        manifold.a = i, manifold.b = j;
        const Manifold* old = last(manifold);
        meet(settings, a, b, old, manifold);
        ++pairs_;
        if (manifold.count == 0) continue;
        if (a.asleep || b.asleep) {
            wake_group(bodies, a.asleep ? i : j);
            woke = true;
        }
        manifold.friction = std::sqrt(a.friction * b.friction);
        manifold.restitution = std::max(a.restitution, b.restitution);
        manifolds_.push_back(manifold);
    }
    if (woke) return true;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const MovingBody& body = bodies[i];
        if (!body.moves() || body.asleep) continue;
        const double grown = kSlop * smallest_half(body) + reach_of(body, settings);
        for (std::size_t p = 0; p < planes.size(); ++p) {
            const WorldPlane& plane = planes[p];
            const double height = plane.normal.dot(body.posed.position) - plane.offset;
            if (height > plane.normal.cwiseAbs().dot(body.posed.half_aabb) + grown) continue;
            Manifold manifold;
            manifold.a = static_cast<int>(i), manifold.b = kFirstPlane + static_cast<int>(p);
            const Manifold* old = last(manifold);
            meet_plane(settings, body, plane, old, manifold);
            ++pairs_;
            if (manifold.count == 0) continue;
            manifold.friction = std::sqrt(body.friction * static_cast<float>(plane.friction));
            manifold.restitution = std::max(body.restitution, static_cast<float>(plane.restitution));
            manifolds_.push_back(manifold);
        }
    }
    std::sort(manifolds_.begin(), manifolds_.end(),
              [](const Manifold& a, const Manifold& b) { return a.key() < b.key(); });
    return false;
}

void WorldContacts::meet(const WorldSettings& settings, const MovingBody& a, const MovingBody& b,
                         const Manifold* before, Manifold& manifold) {
    const PosedBody &pa = a.posed, &pb = b.posed;
    const Eigen::Vector3d apart = pa.position - pb.position;
    const double distance = apart.norm();
    const double size = std::min(smallest_half(a), smallest_half(b));
    // Speed at which the gap can close: of the centres along their line, and of the surfaces about them.
    const Eigen::Vector3d closing = b.state.velocity - a.state.velocity;
    double approach = distance > 1e-9 ? closing.dot(apart) / distance : closing.norm();
    approach += point_speed(a) - a.state.velocity.norm() + point_speed(b) - b.state.velocity.norm();
    const float margin = static_cast<float>(margin_of(approach, size, settings));
    candidates_.clear();
    if (distance > pa.radius + pb.radius + margin) return;
    const Eigen::Vector3f between = apart.cast<float>();
    for (const bool b_sampled : {false, true}) {
        const PosedBody &sampled = b_sampled ? pb : pa, &implicit = b_sampled ? pa : pb;
        found_.clear();
        finder_.find(sampled, implicit, margin, found_);
        const Eigen::Matrix3f turn = implicit.rotation.cast<float>(),
                              turn_sampled = sampled.rotation.cast<float>();
        for (const SampleContact& contact : found_) {
            ManifoldPoint point;
            const Eigen::Vector3f out = turn * contact.normal;
            const Eigen::Vector3f arm =
                turn_sampled * sampled.sample(contact.sample) - 0.5f * contact.separation * out;
            point.feature = static_cast<std::uint32_t>(contact.sample) | (b_sampled ? 1u << 31 : 0u);
            point.separation = contact.separation;
            point.rest = contact.rest;
            if (b_sampled) {
                point.normal = -out;
                point.arm_b = arm, point.arm_a = arm - between;
                point.sample_b = contact.sample;
            } else {
                point.normal = out;
                point.arm_a = arm, point.arm_b = arm + between;
                point.sample_a = contact.sample;
            }
            candidates_.push_back(point);
        }
    }
    choose_points(candidates_, kManifoldTolerance * static_cast<float>(size), before, manifold);
    finish(before, static_cast<float>(size), manifold);
}

void WorldContacts::meet_plane(const WorldSettings& settings, const MovingBody& a, const WorldPlane& plane,
                               const Manifold* before, Manifold& manifold) {
    const PosedBody& posed = a.posed;
    const double size = smallest_half(a);
    const double approach = -plane.normal.dot(a.state.velocity) + point_speed(a) - a.state.velocity.norm();
    const float margin = static_cast<float>(margin_of(approach, size, settings));
    const float height = static_cast<float>(plane.normal.dot(posed.position) - plane.offset);
    const Eigen::Vector3f n = (posed.rotation.transpose() * plane.normal).cast<float>();
    const float* x = posed.sample_data();
    const int stride = posed.kind->batches * kLanes;
    const Eigen::Matrix3f turn = posed.rotation.cast<float>();
    const Eigen::Vector3f normal = plane.normal.cast<float>();
    candidates_.clear();
    for (int first = 0; first < stride; first += kLanes) {
        const Lanes s = n.x() * load_lanes(x + first) + n.y() * load_lanes(x + stride + first) +
                        n.z() * load_lanes(x + 2 * stride + first) + height;
        for (int lane = 0; lane < kLanes && first + lane < posed.kind->samples; ++lane) {
            if (!(s[lane] < margin)) continue;
            ManifoldPoint point;
            point.feature = static_cast<std::uint32_t>(first + lane);
            point.separation = s[lane];
            point.normal = normal;
            point.arm_a = turn * posed.sample(first + lane) - 0.5f * s[lane] * normal;
            point.arm_b.setZero();
            point.sample_a = first + lane;
            point.rest.setZero();
            candidates_.push_back(point);
        }
    }
    choose_points(candidates_, kManifoldTolerance * static_cast<float>(size), before, manifold);
    finish(before, static_cast<float>(size), manifold);
}

}  // namespace sim
