#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace tracking {

/// The frames of a replay that count, by index: later than all before, and after the start-up, which lasts up to the
/// last step of a hand over 30 m/s in the first 0.5 s (hands that still lie at the origin). `position`: of a hand
/// in a frame [m]. What is left out is said in `remarks`.
[[nodiscard]] std::vector<std::size_t> frames_that_count(
    const std::vector<double>& t_s, std::size_t hands,
    const std::function<Eigen::Vector3d(std::size_t frame, std::size_t hand)>& position,
    std::vector<std::string>& remarks);

}  // namespace tracking
