#include "struck/tip_sweep.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kRearm_m = 0.003;
constexpr double kShortestTravel_m = 0.001;
constexpr double kMostStepsASegment = 20000;
constexpr double kBoxOnly_m =
    0.02;  // farther from its box than this, the body's exact distance is not needed
constexpr double kTimeTolerance_s = 1e-9;
constexpr double kDistanceTolerance_m = 1e-11;

}  // namespace

struct TipSweep::Evaluation {
    double t;
    double s;  // signed distance less the radius
    BodyPose pose;
    ClosestPoint foot;
};

struct TipSweep::Walk {
    const TipPath& path;
    std::uint32_t body;
    std::vector<Contact>& contacts;
    Evaluation last;
    bool armed;
};

HermitePiece TipSweep::segment(const PathNode& from, const PathNode& to) const noexcept {
    HermitePiece piece(from, to);
    for (Eigen::Vector3d& b : piece.control) b = (model_->body_from_world() * b).eval();
    return piece;
}

TipSweep::Evaluation TipSweep::evaluate(const HermitePiece& segment, double t, double radius,
                                        const Eigen::Vector3d* start) const noexcept {
    Evaluation e{t, 0, motion_->pose_at(t), {}};
    const Eigen::Vector3d& pivot = model_->definition().stand.pivot_body;
    const Eigen::Vector3d x = pivot + e.pose.hinge.transpose() * (segment.position(t) - pivot);
    e.foot = closest_point(model_->gauge(), e.pose.deformation, x, start);
    e.s = e.foot.distance - radius;
    return e;
}

// Distance between the box [low, high] and the box that holds the body throughout its motion.
double TipSweep::box_distance(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const noexcept {
    const MotionBounds& bounds = motion_->bounds();
    const double pivot = model_->definition().stand.pivot_body.norm();
    const Eigen::Vector3d still = model_->gauge().semi_axes() + bounds.reach;
    const Eigen::Vector3d half = still.array() + bounds.swing * (pivot + still.norm());
    return (low - half).cwiseMax(-half - high).cwiseMax(0).norm();
}

TipSweep::Evaluation TipSweep::close_in(const HermitePiece& segment, const Walk& walk,
                                        const Evaluation& outside, const Evaluation& inside) const noexcept {
    const double radius = walk.path.tip_radius_m;
    const auto at = [&](double t) { return evaluate(segment, t, radius, &outside.foot.rest_point); };
    if (outside.s <= kDistanceTolerance_m) return at(outside.t);
    double ta = outside.t, fa = outside.s, fb = inside.s;  // fa, fb as weighted by the Illinois rule
    Evaluation b = inside;
    for (int i = 1, last_side = 0; i < 100 && b.t - ta > kTimeTolerance_s; ++i) {
        const double share = i % 8 == 0 ? 0.5 : std::clamp(fa / (fa - fb), 1e-3, 1 - 1e-3);
        Evaluation m = at(ta + share * (b.t - ta));
        if (std::abs(m.s) < kDistanceTolerance_m) return m;
        const int side = m.s > 0 ? 1 : -1;
        if (side > 0) {
            ta = m.t, fa = m.s;
            if (last_side == side) fb *= 0.5;
        } else {
            b = m, fb = m.s;
            if (last_side == side) fa *= 0.5;
        }
        last_side = side;
    }
    return b;
}

Contact TipSweep::contact(const HermitePiece& segment, const Evaluation& at, const TipPath& path,
                          std::uint32_t body) const {
    const Eigen::Isometry3d& world = model_->definition().world_from_body;
    const Eigen::Vector3d& pivot = model_->definition().stand.pivot_body;
    const Eigen::Vector3d arm = at.pose.hinge * (at.foot.point - pivot),
                          normal = at.pose.hinge * at.foot.normal;
    const Eigen::Vector3d surface =
        at.pose.hinge_rate.cross(arm) + at.pose.hinge * (at.pose.deformation_rate * at.foot.rest_point);
    Contact c;
    c.stick = path.stick;
    c.body = body;
    c.t_s = at.t;
    c.speed_mps = -normal.dot(segment.velocity(at.t) - surface);
    c.zone = zone_at(model_->definition(), at.foot.rest_point);
    c.point_world = world * (pivot + arm);
    c.normal_world = world.linear() * normal;
    c.point_body = at.foot.rest_point;
    c.impulse_body = -model_->impulse_per_speed() * std::max(0.0, c.speed_mps) * at.foot.normal;
    return c;
}

void TipSweep::march(const HermitePiece& segment, Walk& walk) const {
    const Eigen::Vector3d& pivot = model_->definition().stand.pivot_body;
    double arm = 0;
    for (const Eigen::Vector3d& b : segment.control) arm = std::max(arm, (b - pivot).norm());
    const MotionBounds& bounds = motion_->bounds();
    const double speed = segment.greatest_speed() + bounds.speed.norm() + bounds.turn * arm;
    if (speed == 0) return;
    const double shortest =
        std::max(kShortestTravel_m, speed * (segment.t1_s - segment.t0_s) / kMostStepsASegment);
    const double radius = walk.path.tip_radius_m;
    while (walk.last.t < segment.t1_s) {
        const double travel = std::max(walk.armed ? walk.last.s : kRearm_m - walk.last.s, shortest);
        const double t = std::min(segment.t1_s, walk.last.t + travel / speed);
        const Eigen::Vector3d x = segment.position(t);
        const double far = box_distance(x, x) - radius;
        if (far > kBoxOnly_m) {
            walk.last.t = t, walk.last.s = far, walk.armed = true;
            continue;
        }
        const Evaluation next = evaluate(segment, t, radius, &walk.last.foot.rest_point);
        if (walk.armed && next.s < 0) {
            walk.contacts.push_back(
                contact(segment, close_in(segment, walk, walk.last, next), walk.path, walk.body));
            walk.armed = false;
        } else if (next.s >= kRearm_m) {
            walk.armed = true;
        }
        walk.last = next;
    }
}

double TipSweep::sweep(const TipPath& path, std::uint32_t body, std::vector<Contact>& contacts) const {
    const HermitePiece first = segment(path.nodes[0], path.nodes[1]);
    Walk walk{path, body, contacts, evaluate(first, first.t0_s, path.tip_radius_m, nullptr), true};
    const double clearance = walk.last.s;
    if (clearance < 0) {
        Contact c = contact(first, walk.last, path, body);
        c.starts_inside = true;
        c.depth_m = -clearance;
        contacts.push_back(c);
        walk.armed = false;
    }
    for (std::size_t i = 0; i + 1 < path.nodes.size(); ++i) {
        const HermitePiece s = segment(path.nodes[i], path.nodes[i + 1]);
        const auto& b = s.control;
        const Eigen::Vector3d low = b[0].cwiseMin(b[1]).cwiseMin(b[2]).cwiseMin(b[3]);
        const Eigen::Vector3d high = b[0].cwiseMax(b[1]).cwiseMax(b[2]).cwiseMax(b[3]);
        const double far = box_distance(low, high) - path.tip_radius_m;
        if (far > kRearm_m) {
            walk.last.t = s.t1_s, walk.last.s = far, walk.armed = true;
        } else {
            march(s, walk);
        }
    }
    return clearance;
}

}  // namespace sim
