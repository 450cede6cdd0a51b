#include "trace/orientation_forms.h"

#include <Eigen/LU>
#include <numbers>
#include <string_view>

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

std::optional<Eigen::Matrix3d> axes_of(const std::string& frame) {
    if (frame == "unity") return axes_of("RUF");
    if (frame == "unreal") return axes_of("FRU");
    constexpr std::string_view kDirections = "RUBLDF";  // our axes, then what is opposite to them
    if (frame.size() != 3) return std::nullopt;
    Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t direction = kDirections.find(frame[axis]);
        if (direction == std::string_view::npos) return std::nullopt;
        m(static_cast<Eigen::Index>(direction % 3), static_cast<Eigen::Index>(axis)) = direction < 3 ? 1 : -1;
    }
    if (m.determinant() == 0) return std::nullopt;
    return m;
}

Eigen::Quaterniond from_axes(const Eigen::Matrix3d& m, const Eigen::Quaterniond& q) {
    Eigen::Quaterniond turned;
    turned.w() = q.w();
    turned.vec() = m.determinant() * (m * q.vec()) + Eigen::Vector3d::Zero();  // -0 becomes 0
    return turned;
}

}  // namespace tracking
