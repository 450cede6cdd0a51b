#include "alsa_output.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <thread>

#include "clocks.h"
#include "rendering.h"
#include "sample_folder.h"

namespace {

using namespace rendering;

std::string refusal_of(const std::string& device) {
    try {
        const audio::AlsaOutput output(device, 0.004);
    } catch (const std::runtime_error& refused) {
        return refused.what();
    }
    return "opened";
}

TEST(AlsaOutput, ADeviceThatIsNotThereIsAClearErrorOfOneLine) {
    for (const std::string device : {"hw:77", "no_such_device", "pipewire"}) {
        const std::string message = refusal_of(device);
        if (device == "pipewire" && message == "opened") continue;  // PipeWire runs here
        EXPECT_EQ(message.find("ALSA: device `" + device + "`: found "), 0U) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
        EXPECT_EQ(message.find("pipewire-alsa") != std::string::npos, device == "pipewire") << message;
    }
}

TEST(AlsaOutput, TheNullDeviceTakesNothingFromWhatIsRecorded) {
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
}

TEST(AlsaOutput, ItsThreadBeginsWithWhatItWasGiven) {
    std::promise<std::thread::id> began;
    audio::AlsaOutput output("null", 0.004, [&] { began.set_value(std::this_thread::get_id()); });
    EXPECT_NE(began.get_future().get(), std::this_thread::get_id());
}

/// ALSA's plugin that writes what is played into a file, configured by ALSA_CONFIG_PATH, which libasound reads once a
/// process: set before the first test, beside the system's own configuration.
class PlayedFile : public testing::Environment {
public:
    void SetUp() override {
        folder_.emplace();
        const auto configuration = folder_->text(
            "asound.conf",
            "</usr/share/alsa/alsa.conf>\npcm.musicworld_file { type file; slave.pcm null; file \"" +
                path().string() + "\"; format raw }\n");
        ASSERT_EQ(setenv("ALSA_CONFIG_PATH", configuration.c_str(), 1), 0);
    }
    void TearDown() override { folder_.reset(); }
    [[nodiscard]] std::filesystem::path path() const { return folder_->path() / "played"; }

private:
    std::optional<SampleFolder> folder_;
};
const auto* const kPlayed =
    static_cast<PlayedFile*>(testing::AddGlobalTestEnvironment(new PlayedFile));  // GoogleTest's to delete

/// The largest value of what was played so far.
float peak_of_played() {
    std::ifstream file(kPlayed->path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    std::vector<float> played(bytes.size() / sizeof(float));
    std::memcpy(played.data(), bytes.data(), played.size() * sizeof(float));
    float peak = 0;
    for (const float x : played) peak = std::max(peak, std::abs(x));
    return peak;
}

TEST(AlsaOutput, WhatTheDeviceGetsIsTheSoundLimited) {
    const std::vector<audio::Voice> voices{voice("bell", {{"decay_s", 0.2}, {"variation", 0}})};
    {
        Kept kept;
        audio::LiveOptions options{
            .longest_s = 60, .output = audio::LiveOptions::Output::alsa, .alsa_device = "musicworld_file"};
        options.mix.gain_db = 30;  // far over full scale
        audio::LivePerformance live(kOrchestra, voices, kept.with(options));
        const std::int64_t epoch = audio::monotonic_ns() + 50'000'000;
        live.start(epoch);
        // Strokes until the device's thread has had the time to play one.
        for (std::uint64_t id = 1; id <= 100 && peak_of_played() <= 0.5F; ++id) {
            ASSERT_TRUE(live.schedule(note(id, static_cast<std::int64_t>(id) * 14400 - 9600, 8)));
            audio::sleep_until_ns(epoch + static_cast<std::int64_t>(id) * 300'000'000);
        }
        const auto& sound = kept.finish(live, 9600, 96000);
        float peak = 0;
        for (const float x : sound) peak = std::max(peak, std::abs(x));
        EXPECT_GT(peak, 1) << "what is recorded is as it was";
    }
    EXPECT_GT(peak_of_played(), 0.5F);
    EXPECT_LT(peak_of_played(), 0.9F) << "-1 dBTP";
}

}  // namespace
