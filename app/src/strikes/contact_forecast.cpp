#include "strikes/contact_forecast.h"

#include <sim/hermite_piece.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "strikes/true_contacts.h"

namespace app {
namespace {

constexpr double kWorthKeeping = 0.05;
constexpr double kSoonestS = 0.001;
constexpr double kThroughS = 0.03;  // the path goes on beyond the contact
constexpr int kPieces = 8;

/// The position `t_s` of the path's clock, and the velocity; beyond its end as there.
sim::PathNode node_at(const sim::TipPath& path, double t_s) {
    std::size_t i = 0;
    while (i + 2 < path.nodes.size() && path.nodes[i + 1].t_s < t_s) ++i;
    const sim::HermitePiece piece(path.nodes[i], path.nodes[i + 1]);
    const double within_s = std::min(t_s, path.nodes[i + 1].t_s);
    const Eigen::Vector3d velocity = piece.velocity(within_s);
    return {t_s, piece.position(within_s) + (t_s - within_s) * velocity, velocity};
}

/// An upper bound of the speed along a path [m/s]: of cubic pieces, whose velocity is a parabola between the nodes'.
double greatest_speed(const sim::TipPath& path) {
    double speed = 0;
    for (std::size_t i = 1; i < path.nodes.size(); ++i) {
        const sim::PathNode &a = path.nodes[i - 1], &b = path.nodes[i];
        const double mean = (b.position - a.position).norm() / (b.t_s - a.t_s),
                     ends = a.velocity.norm() + b.velocity.norm();
        speed = std::max({speed, a.velocity.norm(), b.velocity.norm(), 1.5 * mean + 0.25 * ends});
    }
    return speed;
}

/// The plane that touches a surface where a path meets it from outside, or else where it is nearest to the path.
///
/// Goes along the path by steps that cannot reach the surface (conservative advancement, Mirtich 1996), so it passes
/// through no body, however thin.
tracking::Plane plane_met(const ContactForecast::Nearest& nearest, std::size_t surface,
                          const sim::TipPath& path) {
    constexpr int kMostSteps = 64;
    constexpr double kTouches = 1e-4, kShare = 0.8;  // [m]; distances are right to a tenth
    const double speed = std::max(greatest_speed(path), 1e-3), end_s = path.nodes.back().t_s;
    tracking::Plane plane;
    double least = std::numeric_limits<double>::infinity(), t_s = path.nodes.front().t_s;
    for (int step = 0; step < kMostSteps && t_s <= end_s; ++step) {
        const Eigen::Vector3d position = node_at(path, t_s).position;
        const sim::SurfacePoint at = nearest(surface, position);
        if (at.distance < least) {
            least = at.distance;
            plane = {position - at.distance * at.normal, at.normal};
        }
        if (at.distance < kTouches) break;
        t_s = t_s < end_s ? std::min(t_s + kShare * at.distance / speed, end_s) : end_s + 1;
    }
    return plane;
}

/// Along the plane as `predicted`, towards it from the tip so that it is met `in_s` after the sample.
sim::TipPath path_to(const tracking::Plane& plane, double in_s, const tracking::TipView& tip,
                     const sim::TipPath& predicted) {
    const Eigen::Vector3d& n = plane.normal;
    const double start_s = predicted.nodes.front().t_s, height = n.dot(tip.tip - plane.point);
    const double mean = height / in_s, first = std::clamp(-n.dot(tip.velocity), 0.0, 2 * mean);
    const double last = 2 * mean - first, acceleration = (last - first) / in_s;
    const Eigen::Vector3d off = tip.tip - predicted.nodes.front().position;
    sim::TipPath path = predicted;
    path.nodes.clear();
    const auto add = [&](double after_s) {
        const double falling_s = std::min(after_s, in_s);
        const double fallen = falling_s * (first + 0.5 * acceleration * falling_s) +
                              (after_s - falling_s) * std::max(last, mean);
        const double falling = after_s < in_s ? first + acceleration * after_s : std::max(last, mean);
        const sim::PathNode own = node_at(predicted, start_s + after_s);
        const Eigen::Vector3d position = own.position + off, velocity = own.velocity;
        path.nodes.push_back({start_s + after_s,
                              position + (height - fallen - n.dot(position - plane.point)) * n,
                              velocity - (falling + n.dot(velocity)) * n});
    };
    for (int i = 0; i < kPieces; ++i) add(in_s * i / kPieces);
    add(in_s);
    add(in_s + kThroughS);
    return path;
}

}  // namespace

ContactForecast::Forecast ContactForecast::after(const tracking::TipView& tip, const sim::TipPath& predicted,
                                                 const Surfaces& surfaces, double reach_s) const {
    tracking::Plane struck;
    Path expected;
    expected.probability = kWorthKeeping;
    Forecast forecast;
    for (std::size_t surface = 0; surface < surfaces.count; ++surface) {
        if (surfaces.nearest(surface, tip.tip).distance <= 0) return {};
        const tracking::Plane plane = plane_met(surfaces.nearest, surface, predicted);
        forecast.times.emplace_back();
        if (plane.normal.dot(tip.tip - plane.point) <= 0) continue;  // beside it
        const tracking::ContactTimes times = tracking::contact_times(*model_, tip, plane);
        if (!(times.probability() > 0)) continue;  // out of reach
        forecast.times.back() = times;
        const double median_s = std::max(times.median_s(), kSoonestS);
        const double likely = times.probability_between(median_s - kMatchWindow_s, median_s + kMatchWindow_s);
        if (median_s > reach_s || likely <= expected.probability) continue;
        expected.probability = likely, expected.in_s = median_s, expected.surface = surface, struck = plane;
    }
    if (!(expected.in_s > 0)) return forecast;
    expected.path = path_to(struck, expected.in_s, tip, predicted);
    forecast.strike = std::move(expected);
    return forecast;
}

}  // namespace app
