#include "audio/loudness.h"

#include <ebur128.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>

#include "audio/performance.h"

namespace audio {
namespace {

struct Destroy {
    void operator()(ebur128_state* state) const noexcept { ebur128_destroy(&state); }
};

std::optional<double> if_finite(double value) {
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace

Loudness measure_loudness(std::span<const float> interleaved) {
    const std::unique_ptr<ebur128_state, Destroy> state(
        ebur128_init(2, kSampleRate, EBUR128_MODE_I | EBUR128_MODE_LRA | EBUR128_MODE_TRUE_PEAK));
    if (!state || ebur128_add_frames_float(state.get(), interleaved.data(), interleaved.size() / 2) != 0)
        throw std::bad_alloc();
    Loudness loudness;
    double value = 0;
    if (ebur128_loudness_global(state.get(), &value) == 0) loudness.integrated_lufs = if_finite(value);
    if (loudness.integrated_lufs && interleaved.size() >= 2 * 3 * kSampleRate &&
        ebur128_loudness_range(state.get(), &value) == 0)
        loudness.range_lu = if_finite(value);
    double peak = 0;
    for (unsigned channel = 0; channel < 2; ++channel)
        if (ebur128_true_peak(state.get(), channel, &value) == 0) peak = std::max(peak, value);
    if (peak > 0) loudness.true_peak_dbtp = 20 * std::log10(peak);
    return loudness;
}

double gain_towards(const Loudness& loudness, double target_lufs, double highest_dbtp) {
    if (!loudness.true_peak_dbtp) return 0;
    const double room = highest_dbtp - *loudness.true_peak_dbtp;
    if (!loudness.integrated_lufs) return std::min(0.0, room);
    return std::min(target_lufs - *loudness.integrated_lufs, room);
}

}  // namespace audio
