#include "pictures/camera.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "files/bad_input.h"
#include "files/toml_reader.h"
#include "scene/shared_keys.h"

namespace app {
namespace {

constexpr double kFittedFovDeg = 45, kEdge = 0.04;
constexpr double kVertical =
    0.9999;  // cosine of a view to the vertical from which on it has no up of its own
const double kSteep = std::cos(std::numbers::pi / 12);  // that of a view near the vertical, 15 degrees
constexpr double kLeastDepthM = 0.2;                    // of a point before the eye

const std::vector<Word<CameraSide>> kSides = {{"drummer", CameraSide::drummer},
                                              {"front", CameraSide::front},
                                              {"top", CameraSide::top},
                                              {"side", CameraSide::side}};

Eigen::Vector3d direction_of(CameraSide side) {
    const auto down = [](double degrees, double x, double z) {
        const double angle = degrees * std::numbers::pi / 180;
        return Eigen::Vector3d(x * std::cos(angle), -std::sin(angle), z * std::cos(angle));
    };
    switch (side) {
        case CameraSide::front:
            return down(15, 0, 1);
        case CameraSide::top:
            return {0, -1, 0};
        case CameraSide::side:
            return down(15, -1, 0);
        case CameraSide::drummer:
            break;
    }
    return down(40, 0, -1);
}

void camera_at_keys(Fields& keys, CameraAt& at) {
    keys.number("time", at.t_s, {0, 1e5, "s"}, "Since the first frame.");
    kCamera.keys(keys, at.camera);
}
const TableKind<CameraAt> kCameraAt = {{"camera", "A place of the camera."}, camera_at_keys};

/// That the camera looks somewhere all the way: target - eye goes straight from a's to b's.
bool meets_its_target(const render::Camera& a, const render::Camera& b) {
    const Eigen::Vector3f from = a.target - a.eye, change = b.target - b.eye - from;
    const float share = std::clamp(-from.dot(change) / std::max(change.squaredNorm(), 1e-12f), 0.0f, 1.0f);
    return (from + share * change).norm() < 1e-3f;
}

/// Towards the target.
Eigen::Vector3d view_of(const render::Camera& camera) {
    return (camera.target - camera.eye).cast<double>().normalized();
}

/// The top of its picture: of unit length and across the view, as the renderer takes it.
Eigen::Vector3d up_of(const render::Camera& camera) {
    const Eigen::Vector3d view = view_of(camera), up = camera.up.cast<double>().normalized();
    const Eigen::Vector3d from = std::abs(view.dot(up)) > kVertical ? Eigen::Vector3d(0, 0, -1) : up;
    return (from - from.dot(view) * view).normalized();
}

/// Whether the view on the way from a to b, which turns in a plane from a's to b's, comes near to the vertical: at an
/// end, or where it is steepest in its plane if that lies between them.
bool is_steep(const render::Camera& a, const render::Camera& b) {
    const Eigen::Vector3d from = view_of(a), to = view_of(b), normal = from.cross(to);
    if (std::max(std::abs(from.y()), std::abs(to.y())) > kSteep) return true;
    if (normal.norm() < 1e-9) return false;
    Eigen::Vector3d steepest = Eigen::Vector3d::UnitY() - normal * (normal.y() / normal.squaredNorm());
    if (steepest.norm() < 1e-9) return false;  // level all the way
    steepest.normalize();
    const double before = from.cross(steepest).dot(normal), after = steepest.cross(to).dot(normal);
    return before * after > 0 && std::abs(steepest.y()) > kSteep;
}

/// The up of a camera that came from `from`, its view turned the shortest way.
Eigen::Vector3d carried_up(const render::Camera& from, const render::Camera& now) {
    return Eigen::Quaterniond::FromTwoVectors(view_of(from), view_of(now)) * up_of(from);
}

/// A place that looks straight up or down has no up of its own: it keeps that of the place before.
void keep_up(render::Camera& camera, const render::Camera& before) {
    if (std::abs(view_of(camera).y()) > kVertical) camera.up = carried_up(before, camera).cast<float>();
}

CameraChoice read_places(const std::string& file) {
    CameraChoice choice;
    read_toml({TomlFile("a path of the camera", std::filesystem::path(file))}, "the camera's path",
              [&](Fields& keys) {
                  keys.tables("camera", CameraAt(), kCameraAt, "Its places, in order of time.",
                              [&](const Fields& at, const CameraAt& place) {
                                  at.require(choice.places.empty() || choice.places.back().t_s < place.t_s,
                                             "time", fmt::format("time = {}", place.t_s),
                                             "a time after that of the place before");
                                  at.require(choice.places.empty() ||
                                                 !meets_its_target(choice.places.back().camera, place.camera),
                                             "target", "a camera that meets its target on its way here",
                                             "a target apart from it all the way");
                                  choice.places.push_back(place);
                                  if (choice.places.size() > 1)
                                      keep_up(choice.places.back().camera, (choice.places.end() - 2)->camera);
                              });
              });
    if (choice.places.empty())
        throw BadInput(fmt::format("{}:1:1: error: found no [[camera]], expected at least one", file));
    return choice;
}

std::optional<CameraChoice> read_place(const std::string& text) {
    const std::vector<std::string> parts = split(text, ':');
    if (parts.size() < 2 || parts.size() > 3) return std::nullopt;
    const auto place = as::vector_of_3(as::number(-kRoomM, kRoomM, "m"));
    const auto eye = place.read(parts[0]), target = place.read(parts[1]);
    const auto field =
        parts.size() == 3 ? as::number(5, 120, "degrees").read(parts[2]) : std::optional(kFittedFovDeg);
    if (!eye || !target || !field || (*eye - *target).norm() < 1e-3) return std::nullopt;
    CameraChoice choice;
    choice.places.push_back({0, {eye->cast<float>(), target->cast<float>(), static_cast<float>(*field)}});
    return choice;
}

std::optional<CameraChoice> read_choice(const std::string& text) {
    for (const auto& [name, side] : kSides)
        if (text == name) return CameraChoice{side, {}};
    return text.ends_with(".toml") ? read_places(text) : read_place(text);
}

}  // namespace

ValueFormat<CameraChoice> camera_format() {
    return {
        "VIEW",
        "drummer, front, top, side, EYE:TARGET[:DEGREES] or FILE.toml",
        "drummer, front, top, side, EX,EY,EZ:TX,TY,TZ with two different places (and :DEGREES, 5 to 120) or "
        "FILE.toml",
        read_choice,
        {}};
}

render::Camera fitted_camera(CameraSide side, std::span<const Eigen::Vector3f> points, float aspect) {
    const Eigen::Vector3d forward = direction_of(side);
    const Eigen::Vector3d upwards =
        side == CameraSide::top ? Eigen::Vector3d(0, 0, -1) : Eigen::Vector3d(0, 1, 0);
    const Eigen::Vector3d right = forward.cross(upwards).normalized(), up = right.cross(forward);
    const double high = (1 - 2 * kEdge) * std::tan(kFittedFovDeg * std::numbers::pi / 360),
                 wide = high * double(aspect);
    constexpr double kEver = std::numeric_limits<double>::infinity();
    struct Limits {
        double most = -kEver, least = kEver;
        void take(double x, double tz) { most = std::max(most, x - tz), least = std::min(least, x + tz); }
    } x, y;
    double nearest = kEver, farthest = -kEver;
    for (const Eigen::Vector3f& point : points) {
        const Eigen::Vector3d p = point.cast<double>();
        const double z = forward.dot(p);
        x.take(right.dot(p), wide * z);
        y.take(up.dot(p), high * z);
        nearest = std::min(nearest, z), farthest = std::max(farthest, z);
    }
    const double depth =
        std::min({(x.least - x.most) / (2 * wide), (y.least - y.most) / (2 * high), nearest - kLeastDepthM});
    const Eigen::Vector3d eye =
        0.5 * (x.least + x.most) * right + 0.5 * (y.least + y.most) * up + depth * forward;
    const Eigen::Vector3d target = eye + (0.5 * (nearest + farthest) - depth) * forward;
    return {eye.cast<float>(), target.cast<float>(), static_cast<float>(kFittedFovDeg)};
}

render::Camera standing_camera(const CameraChoice& choice, const std::optional<render::Camera>& own,
                               std::span<const Eigen::Vector3f> points, float aspect) {
    if (choice.side) return fitted_camera(*choice.side, points, aspect);
    if (choice.places.size() == 1) return choice.places.front().camera;
    return own ? *own : fitted_camera(CameraSide::drummer, points, aspect);
}

std::optional<render::Camera> moving_camera(const CameraChoice& choice, double t_s) {
    const std::vector<CameraAt>& places = choice.places;
    if (places.size() < 2) return std::nullopt;
    const auto next = std::ranges::upper_bound(places, t_s, {}, &CameraAt::t_s);
    if (next == places.begin()) return places.front().camera;
    if (next == places.end()) return places.back().camera;
    const CameraAt &a = *(next - 1), &b = *next;
    const auto share = static_cast<float>((t_s - a.t_s) / (b.t_s - a.t_s));
    const auto between = [share]<class T>(const T& from, const T& to) -> T {
        return from + share * (to - from);
    };
    render::Camera now{between(a.camera.eye, b.camera.eye), between(a.camera.target, b.camera.target),
                       between(a.camera.vertical_fov_deg, b.camera.vertical_fov_deg)};
    if (is_steep(a.camera, b.camera)) {
        const Eigen::Vector3d arrived = carried_up(a.camera, b.camera), wanted = up_of(b.camera);
        const double roll = std::atan2(arrived.cross(wanted).dot(view_of(b.camera)), arrived.dot(wanted));
        now.up =
            (Eigen::AngleAxisd(double(share) * roll, view_of(now)) * carried_up(a.camera, now)).cast<float>();
    }
    return now;
}

}  // namespace app
