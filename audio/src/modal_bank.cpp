#include "modal_bank.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace audio {
namespace {

constexpr double kHighestHz = 20000;
constexpr float kHeardBend = 3e-6F;  // 0.005 cents: a smaller change of the bend is left out
constexpr std::size_t kLanes = ModalBank::kLanes;
// Signs of a vector's modes in the side signal.
constexpr std::array<float, kLanes> kSides{1, -1, -1, 1, 1, -1, -1, 1};

// Sixteen lanes' worth of registers: GCC and Clang make AVX of it, or pairs of SSE, with the same results.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

inline void load(Lanes& lanes, const float* from) noexcept {
    std::memcpy(&lanes, from, sizeof lanes);
}

inline void store(float* to, const Lanes& lanes) noexcept {
    std::memcpy(to, &lanes, sizeof lanes);
}

bool is_silent(std::span<const float> samples) noexcept {
    return std::ranges::all_of(samples, [](float x) { return x == 0; });
}

}  // namespace

struct ModalBank::Inputs {
    std::span<const float> force, drive;
};

void ModalBank::set(std::span<const ModeParameters> modes, double sample_rate, double rest_below) noexcept {
    const std::size_t count = std::min(modes.size(), kMostModes);
    groups_ = (count + kTogether - 1) / kTogether;
    const std::size_t filled = groups_ * kTogether;
    for (Column* column : {&real_, &imaginary_, &weight_, &drive_, &angle_, &radius_})
        std::fill_n(column->begin(), filled, 0.0F);
    for (std::size_t i = 0; i < count; ++i) {
        const ModeParameters& mode = modes[i];
        if (!(mode.frequency_hz > 0 && mode.frequency_hz < kHighestHz)) continue;
        angle_[i] = static_cast<float>(2 * std::numbers::pi * mode.frequency_hz / sample_rate);
        radius_[i] =
            static_cast<float>(std::exp(std::log(0.001) / (std::max(mode.t60_s, 0.001) * sample_rate)));
        weight_[i] = static_cast<float>(mode.weight);
        drive_[i] = static_cast<float>(mode.drive);
    }
    for (std::size_t i = 0; i < filled; ++i) rotate(i, 1);
    std::fill_n(sounds_.begin(), groups_, true);
    rest_below_ = static_cast<float>(rest_below);
    ratio_ = 1;
}

void ModalBank::rotate(std::size_t mode, double ratio) noexcept {
    const double angle = std::min(static_cast<double>(angle_[mode]) * ratio, 3.0), radius = radius_[mode];
    cosine_[mode] = static_cast<float>(radius * std::cos(angle));
    sine_[mode] = static_cast<float>(radius * std::sin(angle));
}

void ModalBank::bend(double ratio) noexcept {
    if (std::abs(static_cast<float>(ratio) - ratio_) < kHeardBend) return;
    ratio_ = static_cast<float>(ratio);
    for (std::size_t i = 0; i < groups_ * kTogether; ++i)
        if (sounds_[i / kTogether]) rotate(i, ratio);
}

template <bool kDriven>
void ModalBank::render_group(std::size_t first, const Inputs& inputs, float* sums) noexcept {
    Lanes x0, x1, y0, y1, c0, c1, s0, s1, w0, w1, d0, d1;
    load(x0, &real_[first]), load(x1, &real_[first + kLanes]);
    load(y0, &imaginary_[first]), load(y1, &imaginary_[first + kLanes]);
    load(c0, &cosine_[first]), load(c1, &cosine_[first + kLanes]);
    load(s0, &sine_[first]), load(s1, &sine_[first + kLanes]);
    load(w0, &weight_[first]), load(w1, &weight_[first + kLanes]);
    load(d0, &drive_[first]), load(d1, &drive_[first + kLanes]);
    for (std::size_t n = 0; n < inputs.force.size(); ++n) {
        if constexpr (kDriven) {
            x0 += w0 * inputs.force[n] + d0 * inputs.drive[n];
            x1 += w1 * inputs.force[n] + d1 * inputs.drive[n];
        }
        const Lanes turned0 = c0 * x0 - s0 * y0, turned1 = c1 * x1 - s1 * y1;
        y0 = s0 * x0 + c0 * y0;
        y1 = s1 * x1 + c1 * y1;
        x0 = turned0;
        x1 = turned1;
        Lanes sum;
        load(sum, sums + n * kLanes);
        store(sums + n * kLanes, sum + (y0 + y1));
    }
    store(&real_[first], x0), store(&real_[first + kLanes], x1);
    store(&imaginary_[first], y0), store(&imaginary_[first + kLanes], y1);
}

void ModalBank::render(std::span<const float> force, std::span<const float> drive, std::span<float> mid,
                       std::span<float> side) noexcept {
    std::array<float, kMostSamples * kLanes> sums;
    std::fill_n(sums.begin(), force.size() * kLanes, 0.0F);
    const bool driven = !is_silent(force) || !is_silent(drive);
    const Inputs inputs{force, drive};
    for (std::size_t group = 0; group < groups_; ++group) {
        if (!sounds_[group]) continue;
        const std::size_t first = group * kTogether;
        if (driven) {
            render_group<true>(first, inputs, sums.data());
            continue;
        }
        render_group<false>(first, inputs, sums.data());
        float largest = 0;
        for (std::size_t i = first; i < first + kTogether; ++i)
            largest = std::max(largest, std::max(std::abs(real_[i]), std::abs(imaginary_[i])));
        sounds_[group] = largest >= rest_below_;
    }
    for (std::size_t n = 0; n < force.size(); ++n) {
        mid[n] = side[n] = 0;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            mid[n] += sums[n * kLanes + lane];
            side[n] += kSides[lane] * sums[n * kLanes + lane];
        }
    }
}

}  // namespace audio
