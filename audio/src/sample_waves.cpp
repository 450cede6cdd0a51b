#include "sample_waves.h"

#include <samplerate.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace audio {

std::vector<float> resampled(const std::vector<float>& samples, double ratio, const std::string& place) {
    if (ratio == 1) return samples;
    std::vector<float> result(
        static_cast<std::size_t>(std::ceil(static_cast<double>(samples.size()) * ratio)) + 1);
    SRC_DATA data{};
    data.data_in = samples.data();
    data.input_frames = static_cast<long>(samples.size());
    data.data_out = result.data();
    data.output_frames = static_cast<long>(result.size());
    data.src_ratio = ratio;
    if (const int error = src_simple(&data, SRC_SINC_BEST_QUALITY, 1); error != 0)
        fail_at(place, std::string("a sample that libsamplerate refuses: ") + src_strerror(error),
                "tuning within 256 times");
    result.resize(static_cast<std::size_t>(data.output_frames_gen));
    return result;
}

namespace {

constexpr double kMostLoopedFrames = 1.2e7;  // before tuning

/// The region's envelope n samples after its start, the delay behind it: attack linear, decay linear in dB to the
/// sustain (which counts as -80 dB where it is 0), and once the key is let
/// go, by 80 dB in the release.
class Envelope {
public:
    Envelope(const WrittenRegion& r, double let_go_s)
        : attack_(r.ampeg_attack * kSampleRate),
          hold_(attack_ + r.ampeg_hold * kSampleRate),
          decay_(r.ampeg_decay * kSampleRate),
          sustain_(r.ampeg_sustain / 100),
          let_go_(let_go_s * kSampleRate),
          release_(r.ampeg_release * kSampleRate) {}
    [[nodiscard]] double at(std::size_t n) const {
        const auto x = static_cast<double>(n);
        if (x >= let_go_)
            return held(let_go_) * (release_ > 0 ? std::pow(10, -4 * (x - let_go_) / release_) : 0);
        return held(x);
    }

private:
    [[nodiscard]] double held(double x) const {
        if (x < attack_) return x / attack_;
        if (x < hold_ || sustain_ >= 1) return 1;
        const double share = decay_ > 0 ? (x - hold_) / decay_ : 1;
        if (share >= 1) return sustain_;
        return std::pow(std::max(sustain_, 1e-4), share);
    }

    double attack_, hold_, decay_, sustain_, let_go_, release_;
};

/// A part of a channel, and when its key is let go [s]: never, if it is not looped.
struct CutSound {
    std::vector<float> samples;
    double let_go_s = std::numeric_limits<double>::infinity();
};

/// The region's frames from its offset to its end, the loop as often as it is heard. `ratio`: samples at 48 kHz a frame.
CutSound cut(const WrittenRegion& r, const Recording& recording, int channel, double ratio) {
    const std::vector<float>& all = recording.channels[static_cast<std::size_t>(channel)];
    const auto length = static_cast<std::int64_t>(all.size());
    const std::int64_t end = r.end < 0 ? length : std::min(length, r.end + 1);
    if (r.offset >= end)
        fail_at(
            r.place,
            "offset " + std::to_string(r.offset) + " of a sample that ends at frame " + std::to_string(end),
            "one before its end");
    const bool recorded = recording.loop_end > recording.loop_start;
    const std::int64_t first = r.loop_start >= 0 ? r.loop_start
                               : recorded        ? recording.loop_start
                                                 : r.offset,
                       behind = (r.loop_end >= 0 ? r.loop_end
                                 : recorded      ? recording.loop_end
                                                 : end - 1) +
                                1;
    const bool loops = r.loop_mode == LoopMode::continuous || r.loop_mode == LoopMode::sustain ||
                       (r.loop_mode == LoopMode::as_recorded && recorded);
    CutSound sound;
    if (!loops) {
        sound.samples.assign(all.begin() + r.offset, all.begin() + end);
        return sound;
    }
    if (first >= behind || behind > end || behind <= r.offset)
        fail_at(r.place,
                "a loop from frame " + std::to_string(first) + " to " + std::to_string(behind - 1) +
                    " of a sample from " + std::to_string(r.offset) + " to " + std::to_string(end - 1),
                "one within it");
    const double frame_s = ratio / kSampleRate, decayed_s = r.ampeg_attack + r.ampeg_hold + r.ampeg_decay;
    sound.let_go_s =
        std::min(std::max(static_cast<double>(behind - r.offset) * frame_s, decayed_s), kLongestLoopS);
    const bool dies = r.ampeg_sustain <= 0.01;  // -80 dB
    const double sounds_s = dies ? std::min(sound.let_go_s, decayed_s)
                                 : std::min(sound.let_go_s + r.ampeg_release, kLongestLoopS);
    const double wanted = std::ceil(sounds_s / frame_s) + 1;
    if (!(wanted <= kMostLoopedFrames))
        fail_at(r.place, "a loop of " + std::to_string(wanted) + " frames", "less");
    const auto append = [&](std::int64_t from, std::int64_t to) {
        sound.samples.insert(sound.samples.end(), all.begin() + from, all.begin() + to);
    };
    append(r.offset, behind);
    const double looped = r.loop_mode == LoopMode::sustain ? sound.let_go_s / frame_s : wanted;
    while (static_cast<double>(sound.samples.size()) < looped) append(first, behind);
    if (r.loop_mode == LoopMode::sustain) append(behind, end);
    sound.samples.resize(std::min(sound.samples.size(), static_cast<std::size_t>(wanted)));
    return sound;
}

}  // namespace

double tuning_cents(const WrittenRegion& r, int key) {
    return r.tune + 100 * r.transpose + r.pitch_keytrack * (key - r.pitch_keycenter);
}

Wave make_wave(const WrittenRegion& r, const Recording& recording, int channel, int key) {
    const double cents = tuning_cents(r, key);
    const double ratio = kSampleRate / recording.rate_hz / std::exp2(cents / 1200);
    if (!(ratio > 1.0 / 250 && ratio < 250))
        fail_at(r.place, "a tuning of " + std::to_string(cents) + " cents", "less");
    const CutSound sound = cut(r, recording, channel, ratio);
    if (static_cast<double>(sound.samples.size()) * ratio > 2 * kLongestSampleS * kSampleRate)
        fail_at(r.place, "a tuning of " + std::to_string(cents) + " cents", "less");
    std::vector<float> wave = resampled(sound.samples, ratio, r.place);
    const Envelope envelope(r, sound.let_go_s);
    for (std::size_t i = 0; i < wave.size(); ++i) wave[i] *= static_cast<float>(envelope.at(i));
    const auto delay = static_cast<std::size_t>(std::lround((r.delay + r.ampeg_delay) * kSampleRate));
    wave.insert(wave.begin(), delay, 0.0F);
    wave.resize(wave.size() + kWaveGuard);
    return {std::move(wave), sound.samples.size()};
}

}  // namespace audio
