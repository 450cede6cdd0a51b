#include "report/spectrogram.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace app {
namespace {

constexpr std::size_t kWindow = 2048;
constexpr double kSoundRateHz = 48000, kBinHz = kSoundRateHz / kWindow;
constexpr std::size_t kMostWindows = 4, kHop = kWindow / 2;  // of a column; samples
constexpr float kLeastLevelDb = -200;

/// Transforms windows of a sound: both channels at once, as real and imaginary part of one signal z. By symmetry
/// |L_k|^2 + |R_k|^2 = (|Z_k|^2 + |Z_(N-k)|^2) / 2.
class WindowTransform {
public:
    explicit WindowTransform(std::span<const float> stereo) : stereo_(stereo) {
        for (std::size_t i = 0; i < kWindow; ++i) {
            const double turn = 2 * std::numbers::pi * static_cast<double>(i) / kWindow;
            hann_[i] = static_cast<float>(0.5 - 0.5 * std::cos(turn));
        }
    }
    /// Power (A^2 + B^2) / 2 of each frequency k * kBinHz, the window's middle at sample `middle`.
    const std::vector<double>& power(std::size_t middle) {
        for (std::size_t i = 0; i < kWindow; ++i) {
            const std::size_t at = middle + i;
            const bool there = at >= kWindow / 2 && 2 * (at - kWindow / 2) + 1 < stereo_.size();
            const float* frame = there ? &stereo_[2 * (at - kWindow / 2)] : nullptr;
            signal_[i] = there ? std::complex<float>(frame[0], frame[1]) * hann_[i] : std::complex<float>();
        }
        fft_.fwd(transform_, signal_);
        // A sine of amplitude A becomes |L_k| = A N / 4: the window's mean is 1/2, half of it lies at -f.
        constexpr double kScale = 16.0 / (kWindow * kWindow) / 4;
        for (std::size_t k = 1; k < power_.size(); ++k)
            power_[k] = kScale * (std::norm(transform_[k]) + std::norm(transform_[kWindow - k]));
        return power_;
    }

private:
    std::span<const float> stereo_;
    Eigen::FFT<float> fft_;
    std::vector<float> hann_ = std::vector<float>(kWindow);
    std::vector<std::complex<float>> signal_ = std::vector<std::complex<float>>(kWindow), transform_;
    std::vector<double> power_ = std::vector<double>(kWindow / 2);
};

/// The greatest power of the frequencies in [low_hz, high_hz); without any, by a straight line between the next two.
double power_between(const std::vector<double>& power, double low_hz, double high_hz) {
    const auto first = static_cast<std::size_t>(std::ceil(low_hz / kBinHz));
    const auto last = std::min(static_cast<std::size_t>(std::ceil(high_hz / kBinHz)), power.size());
    if (first < last)
        return *std::max_element(power.begin() + static_cast<std::ptrdiff_t>(first),
                                 power.begin() + static_cast<std::ptrdiff_t>(last));
    const double place = std::min(0.5 * (low_hz + high_hz) / kBinHz, static_cast<double>(power.size() - 2));
    const auto below = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(below);
    return power[below] * (1 - share) + power[below + 1] * share;
}

}  // namespace

double Spectrogram::frequency_hz(double row) const {
    return low_hz * std::pow(high_hz / low_hz, (row + 0.5) / rows);
}

Spectrogram spectrogram(std::span<const float> stereo, int columns, int rows) {
    Spectrogram made{columns, rows, 50, 20000, {}};
    WindowTransform transform(stereo);
    const std::size_t frames = stereo.size() / 2;
    for (std::size_t column = 0; column < static_cast<std::size_t>(columns); ++column) {
        const std::size_t begin = frames * column / static_cast<std::size_t>(columns),
                          end = frames * (column + 1) / static_cast<std::size_t>(columns);
        const std::size_t windows = std::clamp<std::size_t>((end - begin) / kHop, 1, kMostWindows);
        std::vector<double> greatest(kWindow / 2, 0);
        for (std::size_t i = 0; i < windows; ++i) {
            const std::vector<double>& power =
                transform.power(begin + (end - begin) * (2 * i + 1) / (2 * windows));
            for (std::size_t k = 0; k < greatest.size(); ++k) greatest[k] = std::max(greatest[k], power[k]);
        }
        for (int row = 0; row < rows; ++row) {
            const double power =
                power_between(greatest, made.frequency_hz(row - 0.5), made.frequency_hz(row + 0.5));
            made.level_db.push_back(power > 0
                                        ? std::max(kLeastLevelDb, static_cast<float>(10 * std::log10(power)))
                                        : kLeastLevelDb);
        }
    }
    return made;
}

}  // namespace app
