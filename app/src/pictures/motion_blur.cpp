#include "pictures/motion_blur.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <stdexcept>

namespace app {
namespace {

constexpr std::size_t kMost = 65535;

/// Linear light by byte.
const std::array<std::uint32_t, 256>& light_of_byte() {
    static const auto table = [] {
        std::array<std::uint32_t, 256> light{};
        for (std::size_t byte = 0; byte < light.size(); ++byte) {
            const double v = double(byte) / 255;
            const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
            light[byte] = static_cast<std::uint32_t>(std::lround(double(kMost) * linear));
        }
        return light;
    }();
    return table;
}

/// The nearest byte by linear light.
const std::vector<std::uint8_t>& byte_of_light() {
    static const auto table = [] {
        std::vector<std::uint8_t> bytes(kMost + 1);
        for (std::size_t light = 0; light <= kMost; ++light) {
            const double linear = double(light) / double(kMost);
            const double v = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
            bytes[light] = static_cast<std::uint8_t>(std::lround(255 * v));
        }
        return bytes;
    }();
    return table;
}

template <class T>
T straight(const T& a, const T& b, float share) {
    return a + share * (b - a);
}

/// The linear parts are L_b = R S L_a with the turn R nearest to L_b L_a^-1: R is done in part, S by straight lines.
Eigen::Matrix4f between_places(const Eigen::Matrix4f& a, const Eigen::Matrix4f& b, float share) {
    const Eigen::Matrix3f from = a.topLeftCorner<3, 3>(), to = b.topLeftCorner<3, 3>();
    const Eigen::Matrix3f change = to * from.inverse();
    if (a == b || !change.allFinite()) return b;  // also what has no thickness
    const Eigen::Affine3f affine(change);
    const Eigen::Matrix3f turn = affine.rotation();
    const Eigen::Quaternionf part = Eigen::Quaternionf::Identity().slerp(share, Eigen::Quaternionf(turn));
    Eigen::Matrix4f place = straight(a, b, share);
    place.topLeftCorner<3, 3>() =
        part.toRotationMatrix() * straight(from, Eigen::Matrix3f(turn.transpose() * to), share);
    return place;
}

}  // namespace

std::vector<double> exposure_times(double t_s, double open_s) {
    if (open_s <= 0) return {t_s};
    std::vector<double> times;
    for (int i = kBlurMoments - 1; i >= 0; --i) times.push_back(t_s - open_s * i / kBlurMoments);
    return times;
}

render::FrameState between(const render::FrameState& a, const render::FrameState& b, float share) {
    render::FrameState state = b;
    for (std::size_t i = 0; i < b.world_from_object.size(); ++i) {
        if (!a.visible[i] || !b.visible[i]) continue;
        state.world_from_object[i] = between_places(a.world_from_object[i], b.world_from_object[i], share);
        if (!b.modal.empty()) state.modal[i] = straight(a.modal[i], b.modal[i], share);
    }
    if (a.camera && b.camera)
        state.camera = render::Camera{straight(a.camera->eye, b.camera->eye, share),
                                      straight(a.camera->target, b.camera->target, share),
                                      straight(a.camera->vertical_fov_deg, b.camera->vertical_fov_deg, share),
                                      straight(a.camera->up, b.camera->up, share)};
    return state;
}

void LinearMean::add(const render::Image& picture) {
    if (count_++ == 0) {
        width_ = picture.width, height_ = picture.height;
        sums_.assign(picture.rgb.size(), 0);
    }
    if (picture.rgb.size() != sums_.size()) throw std::invalid_argument("LinearMean::add: another size");
    const auto& light = light_of_byte();
    for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += light[picture.rgb[i]];
}

render::Image LinearMean::mean() const {
    if (count_ == 0) throw std::logic_error("LinearMean::mean: no picture");
    const auto& bytes = byte_of_light();
    render::Image picture{width_, height_, {}};
    picture.rgb.reserve(sums_.size());
    for (const std::uint32_t sum : sums_) picture.rgb.push_back(bytes[(sum + count_ / 2) / count_]);
    return picture;
}

}  // namespace app
