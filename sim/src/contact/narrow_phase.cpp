#include "contact/narrow_phase.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "shape/closest_point.h"

namespace sim {
namespace {

constexpr float kOut = 0.01f;  // of the size: bodies put inside each other emerge until they are nearly out
// A body is in another if its centre is, or is nearer to it than this share of its own smallest half extent.
constexpr double kBuried = 0.2;
constexpr std::uint32_t kNearest = 0x7ffffffd;  // feature of the nearest points of a pair
constexpr std::uint32_t kParting = 0x7ffffffe;  // feature of the one contact of bodies inside each other
constexpr std::uint32_t kFoot = 0x7fffffff;     // feature of a body's lowest point over a plane
constexpr float kShallow = 0.3f;  // of the size: deeper in, a sample may be nearer to another face
constexpr float kContrary = 0;    // cosine between normals
constexpr float kBeside = 0.3f;   // cosine with the axis, of normals of samples beside a body
constexpr double kSmaller[] = {0.01, 0.05, 0.25, 0.6,
                               0.9};  // by so much bodies are made smaller to find how they overlap
constexpr float kManifoldTolerance = 0.02f;
constexpr double kExact = 1e-5;           // of the size: tolerance of distances
constexpr double kOnSurface = 1e-3;       // of the way from the centre
constexpr std::uint32_t kOfB = 1u << 31;  // feature: a sample of b

bool is_sample(std::uint32_t feature) {
    return (feature & ~kOfB) < kNearest;
}

bool is_buried(const PosedBody& body, const PosedBody& in) {
    const Eigen::Vector3d centre = in.rotation.transpose() * (body.position - in.position);
    return in.kind->surface.distance(centre).distance < kBuried * smallest_half(body);
}

// begins: the bodies may have been put into each other since the last step.
void finish(const Manifold* before, bool begins, float size, Manifold& manifold) {
    if (manifold.count == 0) return;
    const float deepest = -manifold.points[0].separation;
    manifold.emerging = before && before->emerging ? deepest > kOut * size
                                                   : begins && deepest > static_cast<float>(kDeep) * size;
    manifold.impulse_reach = 0.1f * size;
    if (before) take_impulses(*before, manifold.impulse_reach, manifold);
}

// The contact's distance to the surface itself, where that to first order, a lower bound, is not right:
// outside, where the foot of the normal is not on the surface.
void measure_exactly(const PosedBody& implicit, SampleContact& contact) {
    const BodyKind& kind = *implicit.kind;
    if (contact.separation <= 0 || kind.ellipsoid || kind.surface.has_bumps()) return;
    const Eigen::Vector3d foot = (contact.rest - contact.separation * contact.normal).cast<double>();
    if (std::abs(kind.surface.base().value(foot) - 1) < kOnSurface) return;
    Deformation deformation;
    if (kind.linear()) {
        deformation.matrix = implicit.deformation.cast<double>();
        deformation.inverse = implicit.deformation_inverse.cast<double>();
    }
    const ClosestPoint at =
        closest_point(kind.surface.base(), deformation, deformation.matrix * contact.rest.cast<double>());
    contact.separation = static_cast<float>(at.distance);
    contact.normal = at.normal.cast<float>();
}

// Bodies put so deep into each other that surface samples no longer tell which way is out: one contact along
// the line of the centres (straight up where they coincide), as deep as the bodies overlap along it.
void part(const PosedBody& a, const PosedBody& b, const Eigen::Vector3f& between, const Manifold* before,
          Manifold& manifold) {
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
    point.rest_a.setZero(), point.rest_b.setZero();
    point.sample_a = sample_a, point.sample_b = sample_b;
    manifold.emerging = true;
    manifold.impulse_reach = a.radius;
    if (before) take_impulses(*before, manifold.impulse_reach, manifold);
}

}  // namespace

double smallest_half(const PosedBody& body) noexcept {
    return body.kind->definition.shape.base.semi_axes.minCoeff();
}

void NarrowPhase::pair(const PosedBody& a, const PosedBody& b, const PairSearch& search, Manifold& manifold) {
    const float size = static_cast<float>(std::min(smallest_half(a), smallest_half(b)));
    between_ = (a.position - b.position).cast<float>();
    const bool smooth = !a.kind->surface.has_bumps() && !b.kind->surface.has_bumps();
    candidates_.clear();
    sources_.clear();
    const float tolerance = kManifoldTolerance * size;
    if (smooth && (is_round(a) || is_round(b)) && nearest(a, b, search.margin)) {
        choose(tolerance, search.before);
        return fill(size, search.before, search.may_part, manifold);
    }
    float lowest = find_samples(a, b, search.margin);
    turn_a_ = a.rotation.cast<float>(), turn_b_ = b.rotation.cast<float>();
    if (lowest < 0 && (!search.before || search.before->emerging || search.may_part) &&
        (is_buried(a, b) || is_buried(b, a)))
        return part(a, b, between_, search.before, manifold);
    const bool curved = a.kind->ellipsoid && b.kind->ellipsoid, edges = lowest > 0 && !curved;
    bool apart = lowest > 0 || curved || agree(size);
    if (smooth && (search.nearest || edges)) apart = nearest(a, b, search.margin) || (apart && !edges);
    const bool along = smooth && !apart && measure_along_axis(a, b);
    if (along)
        for (const SampleContact& contact : found_) lowest = std::min(lowest, contact.separation);
    const float first = candidates_.empty() ? lowest : std::min(lowest, candidates_.front().separation);
    sources_.assign(candidates_.size(), -1);
    add_samples(a, b, std::min(search.margin, PointChooser::reach(first, tolerance)));
    do choose(tolerance, search.before);
    while (!along && lowest <= 0 && measure_chosen(a, b, tolerance));
    fill(size, search.before, search.may_part, manifold);
}

// Adds the nearest points if they are within the margin; whether there is a distance at all.
bool NarrowPhase::nearest(const PosedBody& a, const PosedBody& b, float margin) {
    const ConvexBody of_a(a), of_b(b);
    const ConvexDistance d =
        distance_between({&of_a, a.position, a.rotation}, {&of_b, b.position, b.rotation},
                         kExact * std::min(smallest_half(a), smallest_half(b)));
    if (!d.apart) return false;
    if (d.gap > static_cast<double>(margin)) return true;
    ContactCandidate& point = candidates_.emplace_back();
    point.feature = kNearest;
    point.separation = point.closest = static_cast<float>(d.gap);
    point.normal = d.normal.cast<float>();
    point.arm_a = (d.arm_a - 0.5 * d.gap * d.normal).cast<float>();
    point.rest_a = d.rest_a.cast<float>(), point.rest_b = d.rest_b.cast<float>();
    return true;
}

// Samples of either body in the other, or near it; returns the lowest separation. Where none is inside, their
// distances are exact.
float NarrowPhase::find_samples(const PosedBody& a, const PosedBody& b, float margin) {
    found_.clear();
    finder_.find(a, b, margin, found_);
    of_a_ = found_.size();
    finder_.find(b, a, margin, found_);
    float lowest = 1e30f;
    for (const SampleContact& contact : found_) lowest = std::min(lowest, contact.separation);
    if (lowest <= 0) return lowest;
    lowest = 1e30f;
    for (std::size_t i = 0; i < found_.size(); ++i) {
        measure_exactly(i < of_a_ ? b : a, found_[i]);
        if (found_[i].separation < margin) lowest = std::min(lowest, found_[i].separation);
    }
    return lowest;
}

// Whether samples inside tell by themselves how the bodies touch: not deep, and not in contradiction.
bool NarrowPhase::agree(float size) const {
    std::size_t lowest = 0;
    for (std::size_t i = 1; i < found_.size(); ++i)
        if (found_[i].separation < found_[lowest].separation) lowest = i;
    if (found_[lowest].separation < -kShallow * size) return false;
    const Eigen::Vector3f out = normal_of(lowest);
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (found_[i].separation <= 0 && normal_of(i).dot(out) < kContrary) return false;
    return true;
}

// World axes, from b towards a.
Eigen::Vector3f NarrowPhase::normal_of(std::size_t found) const {
    return found < of_a_ ? Eigen::Vector3f(turn_b_ * found_[found].normal)
                         : Eigen::Vector3f(-(turn_a_ * found_[found].normal));
}

// Of smooth bodies that overlap: the axis along which the least part of them does, between the nearest points of the bodies
// made smaller, and everything measured along it. False: not even their innermost parts are apart.
bool NarrowPhase::measure_along_axis(const PosedBody& a, const PosedBody& b) {
    const double size = std::min(smallest_half(a), smallest_half(b));
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    const ConvexBody whole_a(a), whole_b(b);
    auto separation = [&](const Eigen::Vector3d& n) {
        return n.dot(between_.cast<double>() +
                     a.rotation * whole_a.support(-(a.rotation.transpose() * n)).place -
                     b.rotation * whole_b.support(b.rotation.transpose() * n).place) -
               whole_a.margin() - whole_b.margin();
    };
    for (const double inside : kSmaller) {
        const ConvexBody of_a(a, inside * size), of_b(b, inside * size);
        const ConvexDistance d =
            distance_between({&of_a, a.position, a.rotation}, {&of_b, b.position, b.rotation}, kExact * size);
        if (!d.apart || !(d.gap > kExact * size)) continue;
        axis = d.normal;
        ContactCandidate& point = candidates_.emplace_back();
        point.feature = kNearest;
        point.separation = point.closest = static_cast<float>(separation(axis));
        point.normal = axis.cast<float>();
        point.arm_a = (d.arm_a - 0.5 * d.gap * d.normal).cast<float>();
        point.rest_a = d.rest_a.cast<float>(), point.rest_b = d.rest_b.cast<float>();
        break;
    }
    if (axis.isZero(0)) return false;
    const Eigen::Vector3f n = axis.cast<float>();
    auto furthest = [](const ConvexBody& convex, const Eigen::Vector3d& along) {
        return static_cast<float>(along.dot(convex.support(along).place) + convex.margin());
    };
    const Eigen::Vector3f out_of_b = turn_b_.transpose() * n, out_of_a = -(turn_a_.transpose() * n);
    const float top_b = furthest(whole_b, out_of_b.cast<double>()),
                top_a = furthest(whole_a, out_of_a.cast<double>());
    std::size_t kept = 0, kept_of_a = 0;
    for (std::size_t i = 0; i < found_.size(); ++i) {
        SampleContact contact = found_[i];
        const bool of_a = i < of_a_;
        const float along = normal_of(i).dot(n);
        if (contact.separation > 0 && along < kBeside) continue;  // beside the other, not over it
        // Both the plane at the nearest place and that at the furthest hold the body: the nearer one is nearer to it.
        const Eigen::Vector3f place =
            of_a ? Eigen::Vector3f(turn_b_.transpose() * (turn_a_ * a.sample(contact.sample) + between_))
                 : Eigen::Vector3f(turn_a_.transpose() * (turn_b_ * b.sample(contact.sample) - between_));
        const float height = (of_a ? out_of_b : out_of_a).dot(place) - (of_a ? top_b : top_a);
        const float own = along > kBeside ? contact.separation / along : height;
        contact.separation = contact.separation > 0 ? own : std::max(own, height);
        contact.normal = of_a ? out_of_b : out_of_a;
        found_[kept++] = contact;
        kept_of_a += of_a;
    }
    found_.resize(kept);
    of_a_ = kept_of_a;
    return true;
}

void NarrowPhase::add_samples(const PosedBody& a, const PosedBody& b, float out) {
    for (std::size_t i = 0; i < found_.size(); ++i) {
        if (found_[i].separation > out) continue;
        candidates_.push_back(candidate_of(a, b, i));
        sources_.push_back(static_cast<int>(i));
    }
}

ContactCandidate NarrowPhase::candidate_of(const PosedBody& a, const PosedBody& b, std::size_t found) const {
    const SampleContact& contact = found_[found];
    const bool b_sampled = found >= of_a_;
    const Eigen::Vector3f normal = (b_sampled ? turn_a_ : turn_b_) * contact.normal;
    const Eigen::Vector3f place =
        b_sampled ? turn_b_ * b.sample(contact.sample) : turn_a_ * a.sample(contact.sample);
    const Eigen::Vector3f arm = place - 0.5f * contact.separation * normal;
    ContactCandidate point;
    point.feature = static_cast<std::uint32_t>(contact.sample) | (b_sampled ? kOfB : 0u);
    point.separation = point.closest = contact.separation;
    point.rest_a = point.rest_b = contact.rest;
    point.normal = b_sampled ? Eigen::Vector3f(-normal) : normal;
    point.arm_a = b_sampled ? Eigen::Vector3f(arm - between_) : arm;
    return point;
}

// Makes what was chosen exact; whether something is further out than was thought.
bool NarrowPhase::measure_chosen(const PosedBody& a, const PosedBody& b, float tolerance) {
    bool moved = false;
    for (std::size_t k = 0; k < static_cast<std::size_t>(count_); ++k) {
        const auto at = static_cast<std::size_t>(chosen_[k]);
        if (sources_[at] < 0) continue;
        const auto found = static_cast<std::size_t>(std::exchange(sources_[at], -1));
        const float before = found_[found].separation;
        measure_exactly(found < of_a_ ? b : a, found_[found]);
        if (found_[found].separation == before) continue;
        candidates_[at] = candidate_of(a, b, found);
        moved = moved || found_[found].separation > before + 0.1f * tolerance;
    }
    return moved;
}

void NarrowPhase::plane(const PosedBody& a, const Eigen::Vector3d& plane_normal, float height,
                        const PlaneSearch& search, Manifold& manifold) {
    const float margin = search.margin;
    const Eigen::Vector3d down = -(a.rotation.transpose() * plane_normal);
    const Eigen::Vector3f n = -down.cast<float>();
    const float* x = a.sample_data();
    const int stride = a.kind->batches * kLanes;
    const Eigen::Matrix3f turn = a.rotation.cast<float>();
    const Eigen::Vector3f normal = plane_normal.cast<float>();
    const auto moved = static_cast<float>(plane_normal.dot(search.moved));
    const Eigen::Vector3f turned = (a.rotation.transpose() * plane_normal.cross(search.turned)).cast<float>();
    const float size = static_cast<float>(smallest_half(a)), tolerance = kManifoldTolerance * size;
    candidates_.clear();
    float lowest = margin;
    if (a.kind->ellipsoid) {
        // Of bent bodies one more sample, where they would touch at rest.
        ConvexBody::Point point;
        if (is_bent(a)) {
            point.rest = a.kind->surface.base().support(down);
            point.place = a.deformed(point.rest);
        } else {
            const ConvexBody body(a);
            point = body.support(down);
            point.place += body.margin() * down;
        }
        ContactCandidate foot;
        foot.feature = kFoot;
        foot.rest_a = foot.rest_b = point.rest.cast<float>();
        const Eigen::Vector3f place = turn * point.place.cast<float>();
        foot.separation = foot.closest = normal.dot(place) + height;
        foot.normal = normal;
        foot.arm_a = place - 0.5f * foot.separation * normal;
        if (foot.separation < margin) candidates_.push_back(foot);
    }
    const int samples = is_round(a) ? 0 : stride;
    auto along = [&](const Eigen::Vector3f& v, int first) -> Lanes {
        return v.x() * load_lanes(x + first) + v.y() * load_lanes(x + stride + first) +
               v.z() * load_lanes(x + 2 * stride + first);
    };
    for (int first = 0; first < samples; first += kLanes) {
        const Lanes s = along(n, first) + height, later = s + (along(turned, first) + moved),
                    least = later > 0 ? later : lanes_of(0), closest = s < least ? s : least;
        const float out = std::min(margin, PointChooser::reach(lowest, tolerance));
        for (unsigned left = bits_of((s < margin) & (closest < out)); left != 0; left &= left - 1) {
            const int lane = std::countr_zero(left);
            if (first + lane >= a.kind->samples) break;
            lowest = std::min(lowest, closest[lane]);
            ContactCandidate& point = candidates_.emplace_back();
            point.feature = static_cast<std::uint32_t>(first + lane);
            point.separation = s[lane], point.closest = closest[lane];
            point.normal = normal;
            point.arm_a = turn * a.sample(first + lane) - 0.5f * s[lane] * normal;
            point.rest_a.setZero(), point.rest_b.setZero();
        }
    }
    choose(tolerance, search.before);
    fill(size, search.before, search.may_part, manifold);
}

// The manifold's points out of the chosen candidates, with the impulses of the step before.
void NarrowPhase::fill(float size, const Manifold* before, bool may_part, Manifold& manifold) {
    manifold.count = count_;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
        const ContactCandidate& from = candidates_[static_cast<std::size_t>(chosen_[i])];
        ManifoldPoint& point = manifold.points[i];
        point.feature = from.feature;
        point.separation = from.separation;
        point.normal = from.normal;
        point.arm_a = from.arm_a;
        if (manifold.b >= kFirstPlane) {
            point.arm_b.setZero();
        } else {
            point.arm_b = from.arm_a + between_;
        }
        point.rest_a = from.rest_a, point.rest_b = from.rest_b;
        const int sample = static_cast<int>(from.feature & ~kOfB);
        if (is_sample(from.feature)) (from.feature & kOfB ? point.sample_b : point.sample_a) = sample;
    }
    finish(before, !before || may_part, size, manifold);
}

// Up to four of the candidates.
void NarrowPhase::choose(float tolerance, const Manifold* before) {
    count_ = chooser_.choose(candidates_, tolerance, before, chosen_);
}

}  // namespace sim
