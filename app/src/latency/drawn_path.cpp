#include "latency/drawn_path.h"

#include <sim/simulation.h>

#include <algorithm>
#include <cmath>

namespace app {
namespace {

using Eigen::Vector3d;

constexpr double kStepM = 0.0005;

/// The cubic between two nodes in Bezier's form, u in [0, 1].
class Piece {
public:
    Piece(const DrawnTip& a, const DrawnTip& b)
        : t_s_(a.t_s),
          dt_(b.t_s - a.t_s),
          points_{a.tip, a.tip + dt_ / 3 * a.velocity, b.tip - dt_ / 3 * b.velocity, b.tip} {}

    [[nodiscard]] Vector3d at(double u) const {
        const double v = 1 - u;
        return v * v * v * points_[0] + 3 * u * v * (v * points_[1] + u * points_[2]) +
               u * u * u * points_[3];
    }
    [[nodiscard]] double time_s(double u) const { return t_s_ + u * dt_; }
    [[nodiscard]] double share(double t_s) const { return (t_s - t_s_) / dt_; }
    /// No part of the curve moves faster [m a unit of u]: the derivative lies among its control points.
    [[nodiscard]] double fastest() const {
        double length = 0;
        for (std::size_t i = 0; i < 3; ++i) length = std::max(length, (points_[i + 1] - points_[i]).norm());
        return 3 * length;
    }

private:
    double t_s_, dt_;
    std::array<Vector3d, 4> points_;
};

/// Where `distance` falls to 0 between u (above 0) and w.
template <class Distance>
double root(double u, double w, const Distance& distance) {
    for (int i = 0; i < 40 && w - u > 1e-10; ++i) {
        const double middle = 0.5 * (u + w);
        (distance(middle) > 0 ? u : w) = middle;
    }
    return w;
}

/// Walks a piece from distance `now` at its start in steps that are safe by the distance itself (half of it,
/// for its error); calls found(u) for each way in and returns the distance at the end.
template <class Distance, class Found>
double walk(double now, double fastest, const Distance& distance, const Found& found) {
    for (double u = 0; u < 1;) {
        const double next = std::min(1.0, u + std::max(kStepM, 0.5 * std::abs(now)) / fastest);
        const double before = now;
        now = distance(next);
        if (before > 0 && now <= 0) found(root(u, next, distance));
        u = next;
    }
    return now;
}

std::vector<DrawnTip>::const_iterator first_from(const std::vector<DrawnTip>& nodes, double from_s) {
    return std::lower_bound(nodes.begin(), nodes.end(), from_s,
                            [](const DrawnTip& node, double t_s) { return node.t_s < t_s; });
}

}  // namespace

void DrawnPath::add(const DrawnTip& tip) {
    if (tip.shown && (nodes_.empty() || tip.t_s > nodes_.back().t_s)) nodes_.push_back(tip);
}

std::vector<double> DrawnPath::touches(const sim::BodyDefinition& body, double radius_m, double from_s,
                                       double to_s) const {
    std::vector<double> times;
    auto b = first_from(nodes_, from_s);
    if (b == nodes_.begin() && b != nodes_.end()) ++b;
    double now = 0;
    bool joined = false;  // `now` is the distance at the piece's start
    for (; b != nodes_.end() && (b - 1)->t_s <= to_s; ++b) {
        const Piece piece(*(b - 1), *b);
        if (b->t_s - (b - 1)->t_s > kLongestPieceS) {
            joined = false;
            continue;
        }
        const auto distance = [&](double u) {
            return sim::rest_distance(body, piece.at(u), radius_m).distance;
        };
        now = walk(joined ? now : distance(0), piece.fastest(), distance, [&](double u) {
            const double t_s = piece.time_s(u);
            if (t_s >= from_s && t_s <= to_s) times.push_back(t_s);
        });
        joined = true;
    }
    return times;
}

const DrawnTip* DrawnPath::first_behind(const sim::BodyDefinition& body, double radius_m, double from_s,
                                        double to_s) const {
    for (auto node = first_from(nodes_, from_s); node != nodes_.end() && node->t_s <= to_s; ++node)
        if (node->held || sim::rest_distance(body, node->tip, radius_m).distance <= 0) return &*node;
    return nullptr;
}

Vector3d DrawnPath::position(double t_s) const {
    const auto b = std::upper_bound(nodes_.begin() + 1, nodes_.end() - 1, t_s,
                                    [](double t, const DrawnTip& node) { return t < node.t_s; });
    const Piece piece(*(b - 1), *b);
    return piece.at(piece.share(t_s));
}

DrawnPaths drawn_paths(std::span<const DrawnTip> tips) {
    DrawnPaths paths;
    for (const DrawnTip& tip : tips) paths[{tip.stick, tip.lap}].add(tip);
    return paths;
}

}  // namespace app
