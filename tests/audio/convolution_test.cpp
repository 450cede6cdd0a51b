#include "convolution.h"

#include <gtest/gtest.h>
#include <sndfile.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "audio/samples.h"
#include "rendering.h"
#include "room.h"
#include "sample_folder.h"

namespace {

using namespace rendering;

/// Decaying noise, of each path its own; sample 0 is a sound that comes at once.
audio::ImpulseResponse noise(std::size_t length, bool crossed) {
    std::mt19937 random(1);
    audio::ImpulseResponse response;
    for (std::size_t from = 0; from < 2; ++from)
        for (std::size_t to = 0; to < 2; ++to)
            for (std::size_t n = 0; n < length; ++n) {
                const double x = static_cast<double>(random()) / 2147483648.0 - 1;
                const bool heard = crossed || from == to;
                response.from_to[from][to].push_back(
                    heard ? static_cast<float>(
                                x * std::exp(-3.0 * static_cast<double>(n) / static_cast<double>(length)))
                          : 0.0F);
            }
    return response;
}

TEST(Convolution, ItIsTheSumOfDelayedCopiesFromTheFirstSampleOnForEveryLength) {
    constexpr std::size_t kFrames = 3 * 4096;
    std::mt19937 random(2);
    std::vector<float> input(2 * kFrames, 0.0F);
    std::vector<std::size_t> at;
    for (int i = 0; i < 40; ++i) {  // single samples: their sum is quickly told
        at.push_back(random() % (2 * kFrames));
        input[at.back()] += static_cast<float>(random() % 1000) / 1000 - 0.5F;
    }
    for (const std::size_t length : {1UL, 63UL, 64UL, 65UL, 2048UL, 2049UL, 9000UL}) {
        const audio::ImpulseResponse response = noise(length, true);
        std::vector<double> expected(2 * kFrames, 0.0);
        for (std::size_t k = 0; k < input.size(); ++k) {
            if (input[k] == 0) continue;
            for (std::size_t to = 0; to < 2; ++to)
                for (std::size_t n = 0; n < length && k / 2 + n < kFrames; ++n)
                    expected[2 * (k / 2 + n) + to] += 0.5 * input[k] * response.from_to[k % 2][to][n];
        }
        for (const std::size_t block : {16UL, 64UL}) {
            audio::Convolution convolution(response, 0.5, block);
            std::vector<float> output(input.size(), 0.0F);
            for (std::size_t begin = 0; begin < input.size(); begin += 2 * block)
                convolution.add_answer(std::span(input).subspan(begin, 2 * block),
                                       std::span(output).subspan(begin, 2 * block));
            for (std::size_t i = 0; i < output.size();
                 ++i)  // float transforms of 4096 points: 1e-6 of the sum
                ASSERT_NEAR(output[i], expected[i], 2e-5)
                    << length << ", blocks of " << block << ", at " << i;
        }
    }
}

TEST(Convolution, ARecordedRoomHasItsLevelAndLiveSoundsAsOffline) {
    const auto response = std::make_shared<audio::ImpulseResponse>(noise(20000, true));
    const audio::Mix mix{.gain_db = 0, .room = {.t60_s = 0, .level_db = -6, .impulse = response}};
    audio::Room room(mix.room);
    double energy = 0;
    for (int block = 0; block < 400; ++block) {
        std::vector<float> in(128, 0.0F), out(128, 0.0F);
        if (block == 0) in[0] = in[1] = 1;
        room.add_answer(in, out);
        for (const float x : out) energy += static_cast<double>(x) * x;
    }
    EXPECT_NEAR(10 * std::log10(energy / 2), -6, 0.01);
    expect_live_as_offline(mix);
}

class ImpulseFile : public testing::Test {
protected:
    std::filesystem::path write(int channels, int rate, std::size_t frames, float value) {
        const auto file = folder_.path() / "ir.wav";
        SF_INFO info{};
        info.samplerate = rate, info.channels = channels, info.format = SF_FORMAT_WAV | SF_FORMAT_FLOAT;
        SNDFILE* sound = sf_open(file.c_str(), SFM_WRITE, &info);
        std::vector<float> samples(frames * static_cast<std::size_t>(channels), 0.0F);
        for (int c = 0; c < channels && frames > 0; ++c)
            samples[static_cast<std::size_t>(c)] = value * static_cast<float>(c + 1);
        sf_write_float(sound, samples.data(), static_cast<sf_count_t>(samples.size()));
        sf_close(sound);
        return file;
    }
    SampleFolder folder_;
};

TEST_F(ImpulseFile, OneTwoAndFourChannelsAreItsPathsAndOtherRatesAreResampled) {
    auto mono = audio::read_impulse_response(write(1, 48000, 100, 0.5F));
    EXPECT_EQ(mono->from_to[0][0], mono->from_to[1][1]);
    EXPECT_EQ(mono->from_to[0][1][0], 0);
    auto stereo = audio::read_impulse_response(write(2, 48000, 100, 0.25F));
    EXPECT_EQ(stereo->from_to[0][0][0], 0.25F);
    EXPECT_EQ(stereo->from_to[1][1][0], 0.5F);
    auto four = audio::read_impulse_response(write(4, 48000, 100, 0.125F));
    EXPECT_EQ(four->from_to[0][1][0], 0.25F);
    EXPECT_EQ(four->from_to[1][0][0], 0.375F);
    EXPECT_EQ(four->from_to[1][1][0], 0.5F);
    EXPECT_NEAR(static_cast<double>(audio::read_impulse_response(write(2, 44100, 44100, 0.5F))->size()),
                48000, 2);
}

TEST_F(ImpulseFile, WhatIsNoImpulseResponseIsRefusedWithItsPlace) {
    const auto refused = [&](const std::filesystem::path& file, const std::string& found) {
        try {
            (void)audio::read_impulse_response(file);
            ADD_FAILURE() << found;
        } catch (const audio::SampleError& wrong) {
            EXPECT_NE(std::string(wrong.what()).find("error: found " + found), std::string::npos)
                << wrong.what();
            EXPECT_EQ(std::string(wrong.what()).find(file.string()), 0U) << wrong.what();
        }
    };
    refused(write(3, 48000, 100, 0.5F), "3 channels");
    refused(write(2, 48000, 100, 0), "silence");
    refused(write(1, 8000, 8000 * 21, 0.5F), "21");
    refused(write(1, 96000, 1, 0.5F), "no sound at 48 kHz");
    refused(folder_.path() / "none.wav", "sample");
    std::ofstream(folder_.path() / "text.wav") << "no sound";
    refused(folder_.path() / "text.wav", "\"");
    auto file = write(2, 48000, 10000, 0.5F);
    std::filesystem::resize_file(file, 30);
    refused(file, "\"");
}

}  // namespace
