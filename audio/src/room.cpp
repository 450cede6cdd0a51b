#include "room.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace audio {
namespace {

constexpr std::array<std::size_t, 8> kLengths{1103, 1279, 1433, 1601, 1787, 1951, 2129, 2297};  // primes
constexpr double kShortestS = 0.05;  // of T60: shorter than the lines is no room
constexpr double kHighShare = 0.5;   // of T60 at half the sample rate
// How each line is heard left and right: orthogonal among the even lines and among the odd ones, so that the two
// are as different as can be.
constexpr std::array<double, 8> kLeft{1, 1, 1, 1, -1, -1, -1, -1}, kRight{1, 1, -1, -1, 1, 1, -1, -1};

/// The energy of its answer to one sample of 1 at each side.
double energy_of(const ImpulseResponse& response) {
    double energy = 0;
    for (std::size_t to = 0; to < 2; ++to)
        for (std::size_t n = 0; n < response.size(); ++n) {
            const double both = static_cast<double>(response.from_to[0][to][n]) + response.from_to[1][to][n];
            energy += both * both;
        }
    return energy;
}

}  // namespace

Room::Room(const RoomSound& sound, std::size_t block) {
    if (sound.impulse) {
        const double gain = std::pow(10.0, sound.level_db / 20) * std::sqrt(2 / energy_of(*sound.impulse));
        convolution_ = std::make_unique<Convolution>(*sound.impulse, gain, block);
        tail_samples_ = static_cast<std::int64_t>(sound.impulse->size());
        return;
    }
    if (sound.t60_s < kShortestS) return;
    const double samples = sound.t60_s * kSampleRate;
    for (std::size_t i = 0; i < kLines; ++i) {
        Line& line = lines_[i];
        line.samples.assign(kLengths[i], 0);
        const double decibels = -3 * static_cast<double>(kLengths[i]) / samples;  // log10 of the gain
        line.pole = std::numbers::ln10 / 4 * decibels * (1 - 1 / (kHighShare * kHighShare));
        line.pole = std::fmin(line.pole, 0.95);
        line.gain = std::pow(10.0, decibels) * (1 - line.pole);
    }
    tail_samples_ = static_cast<std::int64_t>(1.5 * samples) + 2 * static_cast<std::int64_t>(kLengths.back());
    // Its level as measured: the energy of its answer to one sample of 1 in each channel.
    level_ = 1;
    std::vector<float> answer(2 * static_cast<std::size_t>(tail_samples_), 0.0F);
    answer[0] = answer[1] = 1;
    add_answer(answer, answer);
    double energy = 0;
    for (std::size_t i = 2; i < answer.size(); ++i) energy += static_cast<double>(answer[i]) * answer[i];
    level_ = std::pow(10.0, sound.level_db / 20) * std::sqrt(2 / energy);
    for (Line& line : lines_) {
        std::ranges::fill(line.samples, 0.0);
        line.state = 0;
        line.at = 0;
    }
}

void Room::add_answer(std::span<const float> input, std::span<float> output) noexcept {
    if (convolution_) return convolution_->add_answer(input, output);
    if (level_ == 0) return;
    for (std::size_t i = 0; i < input.size(); i += 2) {
        const std::array<double, 2> in{input[i], input[i + 1]};
        double left = 0, right = 0, sum = 0;
        std::array<double, kLines> out;
        for (std::size_t k = 0; k < kLines; ++k) {
            Line& line = lines_[k];
            line.state = line.gain * line.samples[line.at] + line.pole * line.state;
            out[k] = line.state;
            left += kLeft[k] * out[k];
            right += kRight[k] * out[k];
            sum += out[k];
        }
        for (std::size_t k = 0; k < kLines; ++k) {
            Line& line = lines_[k];
            line.samples[line.at] = in[k % 2] + out[k] - sum * (2.0 / kLines);
            line.at = line.at + 1 == line.samples.size() ? 0 : line.at + 1;
        }
        output[i] = static_cast<float>(output[i] + level_ * left);
        output[i + 1] = static_cast<float>(output[i + 1] + level_ * right);
    }
}

}  // namespace audio
