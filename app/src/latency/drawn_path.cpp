#include "latency/drawn_path.h"

#include <sim/hermite_piece.h>

#include <algorithm>

#include "kit/surface_entry.h"

namespace app {
namespace {

using Eigen::Vector3d;

constexpr double kTouchToleranceS = 1e-11;

sim::HermitePiece piece_between(const DrawnTip& a, const DrawnTip& b) {
    return {{a.t_s, a.tip, a.velocity}, {b.t_s, b.tip, b.velocity}};
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
        if (b->t_s - (b - 1)->t_s > kLongestPieceS) {
            joined = false;
            continue;
        }
        const sim::HermitePiece piece = piece_between(*(b - 1), *b);
        const auto distance = [&](double t_s) {
            return sim::rest_distance(body, piece.position(t_s), radius_m).distance;
        };
        if (!joined) now = distance(piece.t0_s);
        now = walk(piece.t0_s, piece.t1_s, now, piece.greatest_speed(), distance, [&](const WalkStep& step) {
            if (!step.enters()) return;
            const double t_s = entry_between(step.from, step.to, kTouchToleranceS, distance);
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
    return piece_between(*(b - 1), *b).position(t_s);
}

DrawnPaths drawn_paths(std::span<const DrawnTip> tips) {
    DrawnPaths paths;
    for (const DrawnTip& tip : tips) paths[{tip.stick, tip.lap}].add(tip);
    return paths;
}

}  // namespace app
