#include "view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render {
namespace {

constexpr float kLeastNear = 0.05f, kLeastFar = 60;  // [m]
constexpr float kNearShare = 0.01f;                  // of the distance of what is looked at
constexpr float kShadowMargin = 1.25f;

/// View space: x right, y up, looking along -z.
Eigen::Matrix4f view_from_world(const Eigen::Vector3f& eye, const Eigen::Vector3f& forward,
                                const Eigen::Vector3f& upwards = Eigen::Vector3f::UnitY()) {
    const Eigen::Vector3f back = -forward.normalized();
    const bool along = std::abs(back.dot(upwards.normalized())) > 0.9999f;
    const Eigen::Vector3f up = along ? Eigen::Vector3f(0, 0, -1) : upwards;
    const Eigen::Vector3f right = up.cross(back).normalized();
    Eigen::Matrix3f rotation;
    rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
    Eigen::Matrix4f view = Eigen::Matrix4f::Identity();
    view.topLeftCorner<3, 3>() = rotation;
    view.topRightCorner<3, 1>() = -rotation * eye;
    return view;
}

float half_height_per_distance(const Camera& camera) {
    return std::tan(camera.vertical_fov_deg * std::numbers::pi_v<float> / 360);
}

}  // namespace

Eigen::Matrix4f clip_from_world(const Camera& camera, float aspect) {
    const float scale = 1 / half_height_per_distance(camera);
    // Both go with the distance, so that the step of a depth of 32 bits there, 6e-8 distance^2 / near, is at most
    // 6e-6 of it.
    const float distance = (camera.eye - camera.target).norm();
    const float near = std::max(kLeastNear, kNearShare * distance), far = std::max(kLeastFar, 3 * distance);
    Eigen::Matrix4f projection = Eigen::Matrix4f::Zero();
    projection(0, 0) = scale / aspect;
    projection(1, 1) = scale;
    projection(2, 2) = (far + near) / (near - far);
    projection(2, 3) = 2 * far * near / (near - far);
    projection(3, 2) = -1;
    return projection * view_from_world(camera.eye, camera.target - camera.eye, camera.up);
}

float shadow_reach(const Camera& camera, float aspect) {
    const float half_height = half_height_per_distance(camera) * (camera.target - camera.eye).norm();
    return kShadowMargin * half_height * std::max(1.0f, aspect);
}

Eigen::Matrix4f light_from_world(const KeyLight& light, const Eigen::Vector3f& center, float reach) {
    Eigen::Matrix4f projection = Eigen::Matrix4f::Identity();
    projection(0, 0) = projection(1, 1) = 1 / reach;
    projection(2, 2) =
        -1 / (4 * reach);  // both sides of the centre; nearer casters are clamped to the near plane
    return projection * view_from_world(center, -light.towards_light);
}

}  // namespace render
