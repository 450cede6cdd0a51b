#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "audio/live_performance.h"
#include "audio/performance.h"

/// Shared by the tests of the sound: short ways to voices, notes and their samples.
namespace rendering {

inline const std::string kOrchestra = MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc";
inline const std::vector<std::string> kInstruments{"drum", "bell", "string", "cymbal"};
inline constexpr std::int64_t kLongTail = 10 * audio::kSampleRate;

using Parameters = std::vector<std::pair<std::string, double>>;

inline audio::Voice voice(const std::string& instrument, Parameters parameters = {}, double pan = 0.5,
                          const std::string& choke_group = "") {
    return {instrument, instrument, std::move(parameters), pan, 0, choke_group};
}

inline audio::Note note(std::uint64_t id, std::int64_t onset, double speed_mps = 3, std::uint32_t voice = 0,
                        double place = 0.3, int zone = 0) {
    return {id, voice, onset, speed_mps, place, zone, 38, 64};
}

inline std::vector<float> render(const std::vector<audio::Voice>& voices,
                                 const std::vector<audio::Note>& notes, std::int64_t minimum = 0,
                                 std::int64_t tail = kLongTail) {
    audio::Performance performance(kOrchestra, voices);
    for (const audio::Note& each : notes) performance.schedule(each);
    return performance.finish(minimum, tail);
}

/// Keeps the sound of a performance.
struct Kept {
    std::vector<float> samples;

    audio::LiveOptions with(audio::LiveOptions options) {
        options.take_sound = [this](std::span<const float> sound) {
            samples.insert(samples.end(), sound.begin(), sound.end());
        };
        return options;
    }
    const std::vector<float>& finish(audio::LivePerformance& live, std::int64_t minimum, std::int64_t tail) {
        samples.resize(2 * static_cast<std::size_t>(live.finish(minimum, tail)));
        return samples;
    }
};

/// A bell of 0.3 s sounds live as offline, to the bit.
inline void expect_live_as_offline(const audio::Mix& mix) {
    const std::vector<audio::Voice> voices{voice("bell", {{"decay_s", 0.3}})};
    Kept kept;
    audio::LivePerformance live(kOrchestra, voices, kept.with({.take_sound = {}, .mix = mix}));
    ASSERT_TRUE(live.schedule(note(1, 1000)));
    audio::Performance offline(kOrchestra, voices, mix);
    offline.schedule(note(1, 1000));
    EXPECT_EQ(kept.finish(live, 48000, 96000), offline.finish(48000, 96000));
}

/// Left channel.
inline std::vector<double> left(const std::vector<float>& interleaved) {
    std::vector<double> samples;
    for (std::size_t i = 0; i < interleaved.size(); i += 2) samples.push_back(interleaved[i]);
    return samples;
}

}  // namespace rendering
