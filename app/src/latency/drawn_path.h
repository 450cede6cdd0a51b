#pragma once
#include <sim/modal_body.h>

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "latency/timings.h"

namespace app {

/// The path of one stick's tip as the screen shows it during one lap: a cubic Hermite curve through the tips
/// and their velocities of the frames that were shown in time, on the lap's clock. The tips are those
/// that were predicted for the frames (DrawnTip), before a stick that meets a surface is held there. No curve
/// joins frames more than kLongestPieceS apart.
class DrawnPath {
public:
    static constexpr double kLongestPieceS = 0.25;

    /// Tips that are not shown, or not later than the one before, are left out.
    void add(const DrawnTip& tip);

    /// When the curve comes into `body`'s rest surface grown by `radius_m` from outside, within [from_s,
    /// to_s], by time; to 1e-11 s. Dips of less than 0.5 mm along the path may be passed over.
    [[nodiscard]] std::vector<double> touches(const sim::BodyDefinition& body, double radius_m, double from_s,
                                              double to_s) const;
    /// The first node from `from_s` to `to_s` at which the stick is drawn at or behind that surface: behind
    /// it, or held. Null if there is none.
    [[nodiscard]] const DrawnTip* first_behind(const sim::BodyDefinition& body, double radius_m,
                                               double from_s, double to_s) const;

    [[nodiscard]] Eigen::Vector3d position(double t_s) const;  ///< between the first node and the last

private:
    std::vector<DrawnTip> nodes_;  // by time
};

/// By stick and lap.
using DrawnPaths = std::map<std::pair<std::uint32_t, std::uint64_t>, DrawnPath>;
[[nodiscard]] DrawnPaths drawn_paths(std::span<const DrawnTip> tips);

}  // namespace app
