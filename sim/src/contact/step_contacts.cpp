#include "contact/step_contacts.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// How far the normal of a pair may turn until it touches; a rebound turns by twice that. Bent bodies touch with
// several samples, whose normals differ by more.
constexpr double kNormalTurn = 0.004, kBentNormalTurn = 0.05;  // [rad]

constexpr std::size_t kLeastPart = 16;  // bodies whose contacts a thread finds at once

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
    if (body.driven) return slop + settings.dt * point_speed(body);
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

void StepContacts::find(const ContactScene& scene) {
    std::swap(before_, manifolds_);
    reach_.resize(scene.bodies.size());
    paths_.resize(scene.bodies.size());
    first_.resize(scene.bodies.size());
    while (narrow_.size() < static_cast<std::size_t>(scene.crew.size()))
        narrow_.push_back(std::make_unique<NarrowPhase>());
    known_.clear();
    impacts_ = 0, fallbacks_before_ += fallbacks();
    while (find_once(scene)) {
    }
}

std::uint64_t StepContacts::fallbacks() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& narrow : narrow_) sum += narrow->fallbacks();
    return sum - fallbacks_before_;
}

void StepContacts::set_reach(const ContactScene& scene, int id) {
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
    Reach& reach = reach_[static_cast<std::size_t>(id)];
    reach = {};
    if (body.driven) {
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

void StepContacts::set_box(const ContactScene& scene, std::size_t i) {
    const int id = scene.participants[i];
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
    const Reach& reach = reach_[static_cast<std::size_t>(id)];
    const Eigen::Vector3d half =
        body.posed.half_aabb.array() + reach.turned + reach.rung + kSlop * smallest_half(body);
    const Eigen::Vector3d &from = body.posed.position, to = from + reach.moved;
    broad_.boxes()[i] = {from.cwiseMin(to) - half, from.cwiseMax(to) + half, id,
                         body.driven || (body.moves() && !body.asleep)};
}

bool StepContacts::find_once(const ContactScene& scene) {
    meetings_.clear();
    followed_.assign(scene.bodies.size(), kNotFollowed);
    watched_.assign(scene.bodies.size(), 0);
    const std::size_t count = scene.participants.size();
    broad_.boxes().resize(count);
    scene.crew.each(count, 64, [&](int, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) set_reach(scene, scene.participants[i]), set_box(scene, i);
    });
    const auto& pairs = broad_.find(scene.crew);
    const std::size_t most = scene.crew.size() == 1 ? 1 : 16 * static_cast<std::size_t>(scene.crew.size());
    const std::size_t parts = std::clamp(count / kLeastPart, std::size_t{1}, most);
    found_.resize(std::max(parts, found_.size()));
    scene.crew.each(parts, 1, [&](int thread, std::size_t first, std::size_t last) {
        for (std::size_t p = first; p < last; ++p) {
            found_[p].first = p * count / parts, found_[p].last = (p + 1) * count / parts;
            found_[p].narrow = narrow_[static_cast<std::size_t>(thread)].get();
            find(scene, pairs, found_[p]);
        }
    });
    gather(scene, parts);
    bool woke = false;
    for (std::size_t p = 0; p < parts; ++p)
        for (const int id : found_[p].woken) wake_group(scene.bodies, id), woke = true;
    if (!woke && !meetings_.empty()) accept_impacts(scene);
    return woke;
}

void StepContacts::find(const ContactScene& scene, const std::vector<std::pair<int, int>>& pairs,
                        Found& found) {
    found.manifolds.clear(), found.meetings.clear(), found.woken.clear();
    found.pairs = 0;
    if (found.first == found.last) return;
    const int first = scene.participants[found.first];
    const auto first_before = std::ranges::lower_bound(before_, first, {}, &Manifold::a);
    found.next_before = static_cast<std::size_t>(first_before - before_.begin());
    auto pair = std::ranges::lower_bound(pairs, first, {}, &std::pair<int, int>::first);
    for (std::size_t k = found.first; k < found.last; ++k) {
        const int i = scene.participants[k];
        for (; pair != pairs.end() && pair->first == i; ++pair)
            if (scene.may_meet(*pair)) meet_pair(scene, i, pair->second, found);
        meet_planes(scene, i, found);
    }
}

// What all threads found, in the order of keys.
void StepContacts::gather(const ContactScene& scene, std::size_t parts) {
    pairs_ = 0;
    std::size_t sum = 0;
    for (std::size_t p = 0; p < parts; ++p) {
        pairs_ += found_[p].pairs;
        meetings_.insert(meetings_.end(), found_[p].meetings.begin(), found_[p].meetings.end());
        found_[p].next_before = std::exchange(sum, sum + found_[p].manifolds.size());  // where they go
    }
    if (parts == 1) return std::swap(manifolds_, found_[0].manifolds);
    manifolds_.resize(sum);
    scene.crew.each(parts, 1, [this](int, std::size_t first, std::size_t last) {
        for (std::size_t p = first; p < last; ++p)
            std::ranges::copy(found_[p].manifolds,
                              manifolds_.begin() + static_cast<std::ptrdiff_t>(found_[p].next_before));
    });
}

// Among ghosts: of an own body with any; a ghost's with what is fixed.
bool ContactScene::may_meet(const std::pair<int, int>& pair) const {
    if (!joined.empty() && std::binary_search(joined.begin(), joined.end(), pair)) return false;
    const MovingBody &a = bodies[static_cast<std::size_t>(pair.first)],
                     &b = bodies[static_cast<std::size_t>(pair.second)];
    if (!a.moves() && !b.moves()) return false;
    if (!among_ghosts) return true;
    return a.own || b.own || !a.moves() || !b.moves();
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
const Manifold* StepContacts::last(std::uint64_t key, Found& found) {
    std::size_t& next = found.next_before;
    while (next < before_.size() && before_[next].key() < key) ++next;
    if (next >= before_.size() || before_[next].key() != key) return nullptr;
    return &before_[next];
}

// Whether the balls that hold two bodies pass each other. Paths under gravity bend by g dt^2 / 8.
bool StepContacts::pass_by(const ContactScene& scene, int i, int j) const {
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

void StepContacts::meet_pair(const ContactScene& scene, int i, int j, Found& found) {
    ++found.pairs;
    if (pass_by(scene, i, j)) return;
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    const Reach &ra = reach_[static_cast<std::size_t>(i)], &rb = reach_[static_cast<std::size_t>(j)];
    const double size = std::min(smallest_half(a), smallest_half(b));
    const Eigen::Vector3d moved = ra.moved - rb.moved;
    const double motion = moved.norm() + ra.turned + rb.turned;
    const Manifold* before = last(static_cast<std::uint64_t>(i) << 32 | static_cast<std::uint32_t>(j), found);
    if (motion > kSlow * size) return meet_fast(scene, i, j, before, found);
    std::vector<Manifold>& manifolds = found.manifolds;
    const std::size_t count = manifolds.size();
    meet_near(scene, i, j, kSlop * size + motion + ra.rung + rb.rung, before, found);
    if (manifolds.size() == count) return;
    if (static_cast<double>(manifolds.back().points[0].separation) > kTouching * size) {
        const double after = separation_after(manifolds.back(), a, b, moved, scene.settings.dt);
        if (after > kSlop * size + ra.rung + rb.rung) return manifolds.pop_back();
        // What would be stopped: where and whether it meets, the paths tell better.
        if (after < 0 && !keeps_normal(manifolds.back(), a, b, moved, ra.turned + rb.turned)) {
            const Impact impact = foresee(scene, i, j);
            const bool nearest = is_round(a.posed) || is_round(b.posed);
            if (!impact.meets || (nearest && !impact.at_once)) manifolds.pop_back();
            if (!impact.meets) return;
            if (nearest && !impact.at_once) found.meetings.push_back({i, j, impact.time, false});
        }
    }
    wake(scene, i, j, found);
}

void StepContacts::meet_near(const ContactScene& scene, int i, int j, double margin, const Manifold* before,
                             Found& found) const {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    Manifold& manifold = found.manifolds.emplace_back();
    manifold.a = i, manifold.b = j;
    found.narrow->pair(a.posed, b.posed, {static_cast<float>(margin), before, scene.may_part(a, b)},
                       manifold);
    if (manifold.count == 0) {
        found.manifolds.pop_back();
        return;
    }
    scene.set_surface(manifold);
}

// By how much places on a body's surface leave the straight way within the step, as it turns now [m].
double StepContacts::bulge(const ContactScene& scene, int id) const {
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
    const double reach = turn_reach_of(*body.kind);
    double turned = reach_[static_cast<std::size_t>(id)].turned;
    if (!(turned > 0) || !(reach > 0)) return 0;
    if (!body.driven)  // closer than that bound
        turned = scene.settings.dt * reach *
                 spin_of(body, body.state.orientation, body.state.angular_momentum).norm();
    return turned * turned / (2 * reach);
}

// What carried load a step ago mostly touches still. What is in each other and had a contact then, or so deep that it was put
// there, is a contact, too, which pushes it out: an impact only stops it, and leaves it to sink on where it turns. But not where
// it turns so fast that no contact stands still over the step.
void StepContacts::meet_fast(const ContactScene& scene, int i, int j, const Manifold* before, Found& found) {
    const MovingBody &a = scene.bodies[static_cast<std::size_t>(i)],
                     &b = scene.bodies[static_cast<std::size_t>(j)];
    const double size = std::min(smallest_half(a), smallest_half(b)), margin = (kSlop + kSlow) * size;
    std::vector<Manifold>& manifolds = found.manifolds;
    auto touches = [&](double separation) {
        const std::size_t count = manifolds.size();
        meet_near(scene, i, j, margin, before, found);
        if (manifolds.size() == count) return false;
        if (static_cast<double>(manifolds.back().points[0].separation) <= separation) return true;
        manifolds.pop_back();
        return false;
    };
    bool stays = before && carries(*before) && touches(margin);
    if (!stays) {
        const Impact impact = foresee(scene, i, j);
        if (!impact.meets) return;
        stays = impact.at_once && bulge(scene, i) + bulge(scene, j) <= kSlow * size &&
                touches(-(before ? kSlop : kDeep) * size);
        if (!stays) found.meetings.push_back({i, j, impact.time, false});
    }
    wake(scene, i, j, found);
    if (stays) watch_turning(i, j, kSlow * size);
}

// Turning on, other places of a pair that touches may meet, even if this one holds nothing up.
void StepContacts::watch_turning(int i, int j, double least) {
    if (reach_[static_cast<std::size_t>(i)].turned + reach_[static_cast<std::size_t>(j)].turned > least)
        for (const int id : {i, j})
            std::atomic_ref(watched_[static_cast<std::size_t>(id)]).store(1, std::memory_order_relaxed);
}

void StepContacts::wake(const ContactScene& scene, int i, int j, Found& found) {
    for (const int id : {i, j})
        if (scene.bodies[static_cast<std::size_t>(id)].asleep) found.woken.push_back(id);
}

void StepContacts::meet_planes(const ContactScene& scene, int i, Found& found) {
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(i)];
    if (!body.moves() || body.asleep) return;
    const Reach& reach = reach_[static_cast<std::size_t>(i)];
    // Free motion without weight, which the plane holds.
    const double dt = scene.settings.dt;
    const Eigen::Vector3d moved = dt * body.state.velocity,
                          turned = dt * spin_of(body, body.state.orientation, body.state.angular_momentum);
    const bool fast = moved.norm() + reach.turned > kSlow * smallest_half(body);
    for (std::size_t p = 0; p < scene.planes.size(); ++p) {
        const WorldPlane& plane = scene.planes[p];
        const double height = plane.normal.dot(body.posed.position) - plane.offset;
        const double margin = kSlop * smallest_half(body) + reach.turned + reach.rung +
                              std::max(0.0, -plane.normal.dot(reach.moved));
        if (height > plane.normal.cwiseAbs().dot(body.posed.half_aabb) + margin) continue;
        ++found.pairs;
        Manifold& manifold = found.manifolds.emplace_back();
        manifold.a = i, manifold.b = kFirstPlane + static_cast<int>(p);
        PlaneSearch search{static_cast<float>(margin), last(manifold.key(), found),
                           scene.may_part(body, body)};
        if (fast) search.moved = moved, search.turned = turned;
        found.narrow->plane(body.posed, plane.normal, static_cast<float>(height), search, manifold);
        if (manifold.count == 0) {
            found.manifolds.pop_back();
            continue;
        }
        scene.set_surface(manifold);
    }
}

}  // namespace sim
