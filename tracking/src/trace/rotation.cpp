#include "tracking/rotation.h"

#include <cmath>

namespace tracking {

Eigen::Quaterniond exponential(const Eigen::Vector3d& v) noexcept {
    const double angle = v.norm();
    // sin(x/2)/x = 1/2 - x^2/48 + ..., whose next term is below 1e-18 for x < 1e-4.
    const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
    return {std::cos(angle / 2), scale * v.x(), scale * v.y(), scale * v.z()};
}

Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) noexcept {
    const double sign = q.w() < 0 ? -1 : 1;
    const double sine = q.vec().norm();
    const double cosine = sign * q.w();
    // atan2(s, c)/s = 1/c - s^2/(3 c^3) + ..., next term below 1e-16 for s < 1e-4.
    const double half_angle_over_sine = sine < 1e-4
                                            ? 1 / cosine - sine * sine / (3 * cosine * cosine * cosine)
                                            : std::atan2(sine, cosine) / sine;
    return 2 * sign * half_angle_over_sine * q.vec();
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept {
    const Eigen::Vector3d a = from.normalized(), b = to.normalized();
    const double cosine = b.dot(a);
    Eigen::Quaterniond rotation;
    if (cosine < -1 + 1e-12) {  // as good as opposite
        rotation.vec() = a.unitOrthogonal();
        rotation.w() = 0;
        return rotation;
    }
    const double s = std::sqrt((1 + cosine) * 2);
    rotation.vec() = a.cross(b) * (1 / s);
    rotation.w() = s * 0.5;
    return rotation;
}

}  // namespace tracking
