#include "modal_bank.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <numbers>

namespace audio {
namespace {

constexpr double kHighestHz = 20000;
constexpr float kHeardBend = 3e-6F;  // 0.005 cents: a smaller change of the bend is left out
constexpr float kHeardRing = 1e-3F;  // a share of the decay time, likewise
constexpr std::size_t kLanes = ModalBank::kLanes;
static_assert(kLanes == 8);

// Registers of lanes: GCC and Clang make AVX of it, or pairs of SSE.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

// In memory, at any address: copied in one piece, since halves that are read back as a whole wait for each other.
using LanesAnywhere = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(4), may_alias));

inline void load(Lanes& lanes, const float* from) noexcept {
    lanes = *reinterpret_cast<const LanesAnywhere*>(from);
}

inline void store(float* to, const Lanes& lanes) noexcept {
    *reinterpret_cast<LanesAnywhere*>(to) = lanes;
}

/// a b + c, rounded once where the processor can; without FMA (the plain baseline) a little otherwise.
inline Lanes multiply_add(const Lanes& a, const Lanes& b, const Lanes& c) noexcept {
#ifdef __FMA__
    return _mm256_fmadd_ps(a, b, c);
#else
    return a * b + c;
#endif
}

bool is_silent(std::span<const float> samples) noexcept {
    return std::ranges::all_of(samples, [](float x) { return x == 0; });
}

/// Four samples' lanes into mid and side: of both halves of a vector, the outer lanes less the inner ones, which the
/// side inverts.
void add_up_four(const float* lanes, float* mid, float* side) noexcept {
    using Four = float __attribute__((vector_size(16)));
    Four halves[8], both[4];
    std::memcpy(halves, lanes, sizeof halves);
    for (std::size_t i = 0; i < 4; ++i) both[i] = halves[2 * i] + halves[2 * i + 1];
    const Four pairs[2] = {__builtin_shufflevector(both[0], both[1], 0, 1, 4, 5) +
                               __builtin_shufflevector(both[0], both[1], 3, 2, 7, 6),
                           __builtin_shufflevector(both[2], both[3], 0, 1, 4, 5) +
                               __builtin_shufflevector(both[2], both[3], 3, 2, 7, 6)};
    const Four outer = __builtin_shufflevector(pairs[0], pairs[1], 0, 2, 4, 6),
               inner = __builtin_shufflevector(pairs[0], pairs[1], 1, 3, 5, 7);
    const Four sum = outer + inner, difference = outer - inner;
    std::memcpy(mid, &sum, sizeof sum);
    std::memcpy(side, &difference, sizeof difference);
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
    bend_ = ring_ = 1;
    for (std::size_t i = 0; i < filled; ++i) rotate(i);
    std::fill_n(sounds_.begin(), groups_, true);
    rest_below_ = static_cast<float>(rest_below);
}

void ModalBank::rotate(std::size_t mode) noexcept {
    const double angle = std::min(static_cast<double>(angle_[mode]) * static_cast<double>(bend_), 3.0),
                 own = radius_[mode],
                 radius = ring_ == 1 ? own : std::pow(own, 1 / static_cast<double>(ring_));
    const std::complex<double> once = std::polar(radius, angle);
    std::complex<double> power = 1;
    float* of_group = &powers_[4 * (mode - mode % kTogether)] + mode % kTogether;
    for (std::size_t k = 1; k <= kAhead; ++k) {
        power = {power.real() * once.real() - power.imag() * once.imag(),
                 power.real() * once.imag() + power.imag() * once.real()};
        if (k != 1 && k != kAhead) continue;
        of_group[0] = static_cast<float>(power.real());
        of_group[kTogether] = static_cast<float>(power.imag());
        of_group += 2 * kTogether;
    }
}

void ModalBank::tune(double bend, double ring) noexcept {
    const auto new_bend = static_cast<float>(bend), new_ring = static_cast<float>(ring);
    if (std::abs(new_bend - bend_) < kHeardBend && std::abs(new_ring - ring_) < kHeardRing * ring_) return;
    bend_ = new_bend, ring_ = new_ring;
    for (std::size_t i = 0; i < groups_ * kTogether; ++i)
        if (sounds_[i / kTogether]) rotate(i);
}

/// From sample `begin` on.
void ModalBank::drive_group(std::size_t first, std::size_t begin, const Inputs& inputs,
                            float* sums) noexcept {
    Lanes x0, x1, y0, y1, c0, c1, s0, s1, w0, w1, d0, d1;
    load(x0, &real_[first]), load(x1, &real_[first + kLanes]);
    load(y0, &imaginary_[first]), load(y1, &imaginary_[first + kLanes]);
    const float* power = &powers_[4 * first];
    load(c0, power), load(c1, power + kLanes);
    load(s0, power + kTogether), load(s1, power + kTogether + kLanes);
    load(w0, &weight_[first]), load(w1, &weight_[first + kLanes]);
    load(d0, &drive_[first]), load(d1, &drive_[first + kLanes]);
    for (std::size_t n = begin; n < inputs.force.size(); ++n) {
        const Lanes force = Lanes{} + inputs.force[n], drive = Lanes{} + inputs.drive[n];
        x0 = multiply_add(d0, drive, multiply_add(w0, force, x0));
        x1 = multiply_add(d1, drive, multiply_add(w1, force, x1));
        const Lanes turned0 = multiply_add(c0, x0, -(s0 * y0)), turned1 = multiply_add(c1, x1, -(s1 * y1));
        y0 = multiply_add(s0, x0, c0 * y0);
        y1 = multiply_add(s1, x1, c1 * y1);
        x0 = turned0;
        x1 = turned1;
        Lanes sum;
        load(sum, sums + n * kLanes);
        store(sums + n * kLanes, sum + (y0 + y1));
    }
    store(&real_[first], x0), store(&real_[first + kLanes], x1);
    store(&imaginary_[first], y0), store(&imaginary_[first + kLanes], y1);
}

/// A multiple of 2 kAhead samples without input.
void ModalBank::ring_group(std::size_t first, std::size_t samples, float* sums) noexcept {
    // p and p^4 are kept, as they say pitch and decay; p^2 and p^3 are made here, which is less than to fetch them.
    Lanes c[kAhead][2], s[kAhead][2], x[2], y[2];
#pragma GCC unroll 2
    for (std::size_t half = 0; half < 2; ++half) {
        const float* power = &powers_[4 * first] + half * kLanes;
        load(c[0][half], power), load(s[0][half], power + kTogether);
        load(c[3][half], power + 2 * kTogether), load(s[3][half], power + 3 * kTogether);
#pragma GCC unroll 2
        for (std::size_t k = 1; k < 3; ++k) {
            c[k][half] = multiply_add(c[k - 1][half], c[0][half], -(s[k - 1][half] * s[0][half]));
            s[k][half] = multiply_add(s[k - 1][half], c[0][half], c[k - 1][half] * s[0][half]);
        }
        load(x[half], &real_[first + half * kLanes]), load(y[half], &imaginary_[first + half * kLanes]);
    }
    for (std::size_t n = 0; n < samples; n += 2 * kAhead) {
        Lanes u[2], v[2];  // four samples later
        for (std::size_t half = 0; half < 2; ++half) {
            u[half] = multiply_add(c[3][half], x[half], -(s[3][half] * y[half]));
            v[half] = multiply_add(s[3][half], x[half], c[3][half] * y[half]);
        }
        for (std::size_t k = 0; k < kAhead; ++k) {
            Lanes now, later;
            load(now, sums + (n + k) * kLanes), load(later, sums + (n + kAhead + k) * kLanes);
            for (std::size_t half = 0; half < 2; ++half) {
                now = multiply_add(c[k][half], y[half], multiply_add(s[k][half], x[half], now));
                later = multiply_add(c[k][half], v[half], multiply_add(s[k][half], u[half], later));
            }
            store(sums + (n + k) * kLanes, now), store(sums + (n + kAhead + k) * kLanes, later);
        }
        for (std::size_t half = 0; half < 2; ++half) {
            x[half] = multiply_add(c[3][half], u[half], -(s[3][half] * v[half]));
            y[half] = multiply_add(s[3][half], u[half], c[3][half] * v[half]);
        }
    }
    for (std::size_t half = 0; half < 2; ++half)
        store(&real_[first + half * kLanes], x[half]), store(&imaginary_[first + half * kLanes], y[half]);
}

/// Of a group's amplitudes.
float ModalBank::largest_square(std::size_t first) const noexcept {
    Lanes x0, x1, y0, y1;
    load(x0, &real_[first]), load(x1, &real_[first + kLanes]);
    load(y0, &imaginary_[first]), load(y1, &imaginary_[first + kLanes]);
    const Lanes square0 = x0 * x0 + y0 * y0, square1 = x1 * x1 + y1 * y1;
    const Lanes larger = square0 > square1 ? square0 : square1;
    float largest = larger[0];
    for (std::size_t lane = 1; lane < kLanes; ++lane)
        largest = larger[lane] > largest ? larger[lane] : largest;
    return largest;
}

void ModalBank::render(std::span<const float> force, std::span<const float> drive, std::span<float> mid,
                       std::span<float> side) noexcept {
    std::array<float, kMostSamples * kLanes> sums;
    std::fill_n(sums.begin(), force.size() * kLanes, 0.0F);
    const bool driven = !is_silent(force) || !is_silent(drive);
    const std::size_t rung = driven ? 0 : force.size() - force.size() % (2 * kAhead);
    const Inputs inputs{force, drive};
    for (std::size_t group = 0; group < groups_; ++group) {
        if (!sounds_[group]) continue;
        const std::size_t first = group * kTogether;
        ring_group(first, rung, sums.data());
        drive_group(first, rung, inputs, sums.data());
        if (driven) continue;
        sounds_[group] = largest_square(first) >= rest_below_ * rest_below_;
    }
    std::size_t n = 0;
    for (; n + 4 <= force.size(); n += 4) add_up_four(&sums[n * kLanes], &mid[n], &side[n]);
    for (; n < force.size(); ++n) {
        const float* lanes = &sums[n * kLanes];
        const float outer = (lanes[0] + lanes[4]) + (lanes[3] + lanes[7]),
                    inner = (lanes[1] + lanes[5]) + (lanes[2] + lanes[6]);
        mid[n] = outer + inner;
        side[n] = outer - inner;
    }
}

}  // namespace audio
