#pragma once
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

// What tests measure in sounds.

/// Centre of the power spectrum of 85 ms at 48 kHz, in Hz, under a window that falls from the onset on: the stroke itself
/// is in it. At least 4096 samples.
inline double centroid_hz(const std::vector<double>& samples) {
    constexpr std::size_t kLength = 4096;
    std::vector<double> windowed(kLength);
    for (std::size_t i = 0; i < kLength; ++i)
        windowed[i] =
            samples[i] * (0.5 + 0.5 * std::cos(std::numbers::pi * static_cast<double>(i) / kLength));
    double weighted = 0, total = 0;
    for (double frequency = 40; frequency < 16000; frequency += 20) {
        // Goertzel's recurrence: the power of one frequency.
        const double turn = 2 * std::cos(2 * std::numbers::pi * frequency / 48000);
        double before = 0, last = 0;
        for (const double x : windowed) {
            const double next = x + turn * last - before;
            before = last, last = next;
        }
        const double power = last * last + before * before - turn * last * before;
        weighted += frequency * power;
        total += power;
    }
    return weighted / total;
}

/// Power of the band above `frequency_hz` at 48 kHz, every 64 samples over 256 of them: a Butterworth high-pass of
/// fourth order (two biquads, the bilinear transform).
inline std::vector<double> high_band(std::vector<double> samples, double frequency_hz) {
    const double k = std::tan(std::numbers::pi * frequency_hz / 48000);
    for (const double q : {0.54119610, 1.3065630}) {
        const double norm = 1 / (1 + k / q + k * k), a1 = 2 * (k * k - 1) * norm,
                     a2 = (1 - k / q + k * k) * norm;
        double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
        for (double& x : samples) {
            const double y = norm * (x - 2 * x1 + x2) - a1 * y1 - a2 * y2;
            x2 = x1, x1 = x, y2 = y1, y1 = y;
            x = y;
        }
    }
    std::vector<double> power;
    for (std::size_t begin = 0; begin + 256 <= samples.size(); begin += 64) {
        double sum = 0;
        for (std::size_t i = begin; i < begin + 256; ++i) sum += samples[i] * samples[i];
        power.push_back(sum);
    }
    return power;
}
