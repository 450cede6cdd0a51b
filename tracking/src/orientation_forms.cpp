#include "orientation_forms.h"

#include <numbers>

#include "tracking/rotation.h"

namespace tracking {

Eigen::Quaterniond from_euler(const Eigen::Vector3d& angles, const std::string& order) {
    const auto turn = [&](std::size_t which) {
        const int axis = order[which] - 'X';
        return exponential(angles[axis] * Eigen::Vector3d::Unit(axis));
    };
    return turn(0) * turn(1) * turn(2);
}

Eigen::Vector3d from_z_up(const Eigen::Vector3d& v) {
    return {v.x(), v.z(), -v.y()};
}

Eigen::Quaterniond from_z_up(const Eigen::Quaterniond& q) {
    constexpr double kHalf = std::numbers::sqrt2 / 2;
    return (Eigen::Quaterniond(kHalf, -kHalf, 0, 0) * q).normalized();
}

}  // namespace tracking
