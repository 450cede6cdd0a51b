#include "alsa_output.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "clocks.h"
#include "rendering.h"

namespace {

using namespace rendering;

std::string message_of(const std::string& device) {
    try {
        const audio::AlsaOutput output(device, 0.004);
    } catch (const std::runtime_error& refused) {
        return refused.what();
    }
    return "opened";
}

TEST(AlsaOutput, ADeviceThatIsNotThereIsAClearErrorOfOneLine) {
    for (const std::string device : {"hw:77", "no_such_device", "pipewire"}) {
        const std::string message = message_of(device);
        if (device == "pipewire" && message == "opened") continue;  // PipeWire runs here
        EXPECT_EQ(message.find("ALSA: device `" + device + "`: found "), 0U) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
    }
    EXPECT_NE(message_of("pipewire").find("pipewire-alsa"), std::string::npos);
}

TEST(AlsaOutput, TheNullDeviceIsPacedByTheClockAndPlaysWithoutUnderruns) {
    Kept kept;
    audio::LivePerformance live(
        kOrchestra, {voice("bell", {{"decay_s", 0.2}})},
        kept.with({.longest_s = 3, .output = audio::LiveOptions::Output::alsa, .alsa_device = "null"}));
    EXPECT_NE(live.device().find("ALSA `null` at 48000 Hz"), std::string::npos) << live.device();
    // The limiter's 64 samples and what the buffer needs beyond the lead of 4 ms.
    EXPECT_GE(live.device_delay_s(), 64 / 48000.0);
    EXPECT_LT(live.device_delay_s(), 0.2);
    const std::int64_t epoch = audio::monotonic_ns() + 100'000'000;
    live.start(epoch);
    ASSERT_TRUE(live.schedule(note(1, 9600)));
    audio::sleep_until_ns(epoch + 600'000'000);
    const auto& sound = kept.finish(live, 48000, 96000);
    EXPECT_EQ(sound, render({voice("bell", {{"decay_s", 0.2}})}, {note(1, 9600)}, 48000, 96000));
    // On a machine that is busy the thread may be late, but not all the time.
    EXPECT_LT(live.device_underruns(), 20U);
}

/// ALSA's plugin that writes what is played into a file, configured by ALSA_CONFIG_PATH, which libasound reads once a
/// process: set before main, beside the system's own configuration.
const std::filesystem::path kPlayed =
    std::filesystem::temp_directory_path() / ("musicworld_alsa_" + std::to_string(getpid()));
const bool kConfigured = [] {
    std::ofstream(kPlayed.string() + ".conf")
        << "</usr/share/alsa/alsa.conf>\npcm.musicworld_file { type file; slave.pcm null; file \""
        << kPlayed.string() << "\"; format raw }\n";
    return setenv("ALSA_CONFIG_PATH", (kPlayed.string() + ".conf").c_str(), 0) == 0;
}();

TEST(AlsaOutput, WhatTheDeviceGetsIsTheSoundLimited) {
    ASSERT_TRUE(kConfigured);
    const std::vector<audio::Voice> voices{voice("bell", {{"decay_s", 0.2}, {"variation", 0}})};
    {
        Kept kept;
        audio::LiveOptions options{
            .longest_s = 3, .output = audio::LiveOptions::Output::alsa, .alsa_device = "musicworld_file"};
        options.mix.gain_db = 30;  // far over full scale
        audio::LivePerformance live(kOrchestra, voices, kept.with(options));
        const std::int64_t epoch = audio::monotonic_ns() + 50'000'000;
        live.start(epoch);
        ASSERT_TRUE(live.schedule(note(1, 4800, 8)));
        audio::sleep_until_ns(epoch + 400'000'000);
        const auto& sound = kept.finish(live, 9600, 96000);
        float peak = 0;
        for (const float x : sound) peak = std::max(peak, std::abs(x));
        EXPECT_GT(peak, 1) << "what is recorded is as it was";
    }
    std::ifstream file(kPlayed, std::ios::binary);
    std::vector<float> played(std::filesystem::file_size(kPlayed) / sizeof(float));
    file.read(reinterpret_cast<char*>(played.data()),
              static_cast<std::streamsize>(played.size() * sizeof(float)));
    float peak = 0;
    for (const float x : played) peak = std::max(peak, std::abs(x));
    EXPECT_GT(peak, 0.5F);
    EXPECT_LT(peak, 0.9F) << "-1 dBTP";
    std::filesystem::remove(kPlayed);
    std::filesystem::remove(kPlayed.string() + ".conf");
}

}  // namespace
