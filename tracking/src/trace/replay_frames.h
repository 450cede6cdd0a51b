#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace tracking {

/// The indices of the usable frames of a replay: later than all before, and after the start-up. The start-up
/// ends with the last step of a hand over 30 m/s in the first 0.5 s: before it hands still lie at the origin.
/// `position`: of a hand in a frame [m]. Frames that are left out are counted in `remarks`.
[[nodiscard]] std::vector<std::size_t> frames_that_count(
    const std::vector<double>& t_s, std::size_t hands,
    const std::function<Eigen::Vector3d(std::size_t frame, std::size_t hand)>& position,
    std::vector<std::string>& remarks);

}  // namespace tracking
