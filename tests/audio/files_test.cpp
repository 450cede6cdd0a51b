#include <gtest/gtest.h>
#include <sndfile.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include "rendering.h"

namespace {

using namespace rendering;

class Files : public testing::Test {
protected:
    void SetUp() override {
        folder_ =
            std::filesystem::temp_directory_path() /
            ("musicworld_audio_" + std::to_string(std::random_device{}()));  // parallel test processes differ
        std::filesystem::create_directory(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    static std::vector<unsigned char> bytes(const std::filesystem::path& file) {
        std::ifstream stream(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }
    static bool can_be_full() { return std::filesystem::exists("/dev/full"); }

    std::filesystem::path folder_;
};

TEST_F(Files, WavReadsBackTheSamplesToHalfA24BitStepAsStereoAt48kHz) {
    const auto sound =
        render({voice("drum"), voice("bell", {}, 0.9)}, {note(1, 10, 5), note(2, 3000, 5, 1)}, 48000, 0);
    EXPECT_EQ(audio::write_wav(folder_ / "a.wav", sound), 0U);
    SF_INFO info{};
    SNDFILE* file = sf_open((folder_ / "a.wav").c_str(), SFM_READ, &info);
    ASSERT_NE(file, nullptr);
    EXPECT_EQ(info.samplerate, 48000);
    EXPECT_EQ(info.channels, 2);
    EXPECT_EQ(info.format, SF_FORMAT_WAV | SF_FORMAT_PCM_24);
    ASSERT_EQ(info.frames, 48000);
    std::vector<int> read(sound.size());
    EXPECT_EQ(sf_read_int(file, read.data(), static_cast<sf_count_t>(read.size())), std::ssize(read));
    sf_close(file);
    for (std::size_t i = 0; i < sound.size(); ++i) {
        ASSERT_LE(std::abs(read[i] / 256 - sound[i] * 8388607.0), 0.5) << i;
    }
}

TEST_F(Files, WavOfTheSameSamplesIsTheSameBytesWithoutATimeStampOrPeakChunk) {
    const auto sound = render({voice("drum")}, {note(1, 10, 5)}, 4800, 0);
    audio::write_wav(folder_ / "a.wav", sound);
    audio::write_wav(folder_ / "b.wav", sound);
    const auto a = bytes(folder_ / "a.wav");
    EXPECT_EQ(a, bytes(folder_ / "b.wav"));
    const std::string text(a.begin(), a.end());
    EXPECT_EQ(text.find("PEAK"), text.npos);
    EXPECT_GE(a.size(), 44 + 3 * sound.size());
    EXPECT_LE(a.size(), 128 + 3 * sound.size());  // headers only
}

TEST_F(Files, WavClipsAndCountsWhatLiesBeyondOne) {
    const std::vector<float> sound{0,     1,     -1, 1.5F, -2, std::numeric_limits<float>::quiet_NaN(),
                                   0.25F, -0.25F};
    EXPECT_EQ(audio::write_wav(folder_ / "a.wav", sound), 3U);
    const auto a = bytes(folder_ / "a.wav");
    const std::vector<unsigned char> samples(a.end() - 24, a.end());
    const std::vector<unsigned char> expected{0,    0,    0,    0xFF, 0xFF, 0x7F, 1,    0,
                                              0x80, 0xFF, 0xFF, 0x7F, 0x01, 0x00, 0x80, 0,
                                              0,    0,    0,    0,    0x20, 0,    0,    0xE0};
    EXPECT_EQ(samples, expected);
}

TEST_F(Files, WavOfNothingIsAnEmptyWav) {
    EXPECT_EQ(audio::write_wav(folder_ / "a.wav", {}), 0U);
    EXPECT_GE(bytes(folder_ / "a.wav").size(), 44U);
}

TEST_F(Files, WavOnAFullDeviceOrInAMissingFolderIsARuntimeErrorWithTheName) {
    const std::vector<float> sound(200000, 0.1F), little(2, 0.1F);
    EXPECT_THROW(audio::write_wav(folder_ / "missing" / "a.wav", sound), std::runtime_error);
    EXPECT_THROW(audio::write_wav(folder_, sound), std::runtime_error);
    if (!can_be_full()) GTEST_SKIP() << "no /dev/full here";
    EXPECT_THROW(audio::write_wav("/dev/full", sound), std::runtime_error);
    EXPECT_THROW(audio::write_wav("/dev/full", little), std::runtime_error);
}

/// A reader of format 0 files of its own, so that the library is not checked by itself.
struct MidiEvent {
    long tick = 0;
    int status = 0, first = 0, second = 0;
    bool operator==(const MidiEvent&) const = default;
};

long number(const std::vector<unsigned char>& data, std::size_t at, std::size_t bytes) {
    long value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value * 256 + data.at(at + i);
    return value;
}

std::vector<MidiEvent> read_track(const std::vector<unsigned char>& data) {
    std::vector<MidiEvent> events;
    long tick = 0;
    int status = 0;
    for (std::size_t at = 22; at < data.size();) {
        long delta = 0;
        do delta = delta * 128 + (data.at(at) & 0x7F);
        while ((data.at(at++) & 0x80) != 0);
        tick += delta;
        if (data.at(at) >= 0x80) status = data.at(at++);
        if (status == 0xFF) {
            events.push_back({tick, status, data.at(at), data.at(at + 1)});
            at += 2U + data.at(at + 1);
        } else {
            events.push_back({tick, status, data.at(at), data.at(at + 1)});
            at += 2;
        }
    }
    return events;
}

TEST_F(Files, MidiHasFormat0At960TicksTheTempoAndEachNoteOnAndOffOnChannel10) {
    audio::Note first = note(1, 48000), second = note(2, 12), third = note(3, 48000 + 2400);
    first.midi_velocity = 127;
    second.midi_note = 0;
    second.midi_velocity = 1;
    const std::vector<unsigned char> data = audio::encode_midi({first, second, third});

    EXPECT_EQ(std::string(data.begin(), data.begin() + 4), "MThd");
    EXPECT_EQ(number(data, 4, 4), 6);
    EXPECT_EQ(number(data, 8, 2), 0);     // format
    EXPECT_EQ(number(data, 10, 2), 1);    // tracks
    EXPECT_EQ(number(data, 12, 2), 960);  // ticks a quarter
    EXPECT_EQ(number(data, 18, 4), std::ssize(data) - 22);
    // 1920 ticks a second; 12 samples are 0.48 ticks; offs come 192 ticks later.
    const std::vector<MidiEvent> expected{{0, 0xFF, 0x51, 3},    {0, 0x99, 0, 1},      {192, 0x89, 0, 0},
                                          {1920, 0x99, 38, 127}, {2016, 0x99, 38, 64}, {2112, 0x89, 38, 0},
                                          {2208, 0x89, 38, 0},   {2208, 0xFF, 0x2F, 0}};
    EXPECT_EQ(read_track(data), expected);
    EXPECT_EQ(number(data, 26, 3), 500000);  // microseconds a quarter, after delta, FF, 51, 03
}

TEST_F(Files, MidiOfTheSameNotesInAnyOrderIsTheSameBytes) {
    std::vector<audio::Note> notes;
    for (std::uint64_t id = 1; id <= 300; ++id) {
        notes.push_back(note(id, static_cast<std::int64_t>(id * 7919 % 100000)));
        notes.back().midi_note = static_cast<int>(id % 128);
    }
    const std::vector<unsigned char> in_order = audio::encode_midi(notes);
    std::shuffle(notes.begin(), notes.end(), std::mt19937(3));
    EXPECT_EQ(audio::encode_midi(notes), in_order);
    EXPECT_EQ(read_track(in_order).size(), 602U);
}

/// Up to the longest delta time, of four bytes.
TEST_F(Files, MidiKeepsOnsetsOfAllSizes) {
    std::vector<audio::Note> notes;
    std::vector<long> ticks;
    for (std::uint64_t id = 1; id < 29; ++id) {
        ticks.push_back((1L << (id - 1)) - 1);
        notes.push_back(note(id, 25 * ticks.back()));
        notes.back().midi_note = static_cast<int>(id);
    }
    std::vector<long> on(29, -1);
    notes.pop_back();  // beyond the last tick with its note-off
    for (const MidiEvent& event : read_track(audio::encode_midi(notes)))
        if (event.status == 0x99) on[static_cast<std::size_t>(event.first)] = event.tick;
    for (std::size_t id = 1; id < 28; ++id) EXPECT_EQ(on[id], ticks[id - 1]) << id;
}

TEST_F(Files, MidiKeepsItsTimesAtAnyTempoAndTellsTempoAndTimeSignature) {
    for (const double bpm : {20.0, 61.7, 90.0, 120.0, 133.3, 400.0}) {
        const audio::Note late = note(1, 3600LL * 48000);
        const std::vector<unsigned char> data = audio::encode_midi({late}, {bpm, 6, 8});
        const long per_quarter = number(data, 12, 2), quarter_us = number(data, 26, 3);
        EXPECT_NEAR(60e6 / static_cast<double>(quarter_us), bpm, 1e-4 * bpm);
        EXPECT_EQ(number(data, 29, 4), 0x00FF5804);
        EXPECT_EQ(number(data, 33, 4), 0x06030C08);  // 6, 2^3, 12 MIDI clocks a beat, 8
        for (const MidiEvent& event : read_track(data)) {
            if (event.status != 0x99) continue;
            const double quarters = static_cast<double>(event.tick) / static_cast<double>(per_quarter);
            EXPECT_NEAR(quarters * static_cast<double>(quarter_us) * 1e-6, 3600, 0.6 / 1900)
                << bpm << ": to half a tick, after an hour";
        }
    }
    EXPECT_EQ(audio::encode_midi({note(1, 480)}), audio::encode_midi({note(1, 480)}, {120, 4, 4}));
    for (const audio::MidiTime& bad : {audio::MidiTime{19, 4, 4}, {500, 4, 4}, {120, 0, 4}, {120, 4, 3}})
        EXPECT_THROW((void)audio::encode_midi({}, bad), std::logic_error);
}

/// LAME puts 1105 samples before the sound, and decoders hand out whole frames of 1152.
TEST_F(Files, AnMp3SoundsAsTheSamples) {
    const auto sound = render({voice("drum")}, {note(1, 4800, 5)}, 48000, 0);
    std::ofstream(folder_ / "a.mp3", std::ios::binary) << audio::encode_mp3(sound);
    EXPECT_EQ(audio::encode_mp3(sound), audio::encode_mp3(sound));
    SF_INFO info{};
    SNDFILE* file = sf_open((folder_ / "a.mp3").c_str(), SFM_READ, &info);
    ASSERT_NE(file, nullptr);
    EXPECT_EQ(info.samplerate, 48000);
    EXPECT_EQ(info.channels, 2);
    std::vector<float> heard(static_cast<std::size_t>(2 * info.frames));
    EXPECT_EQ(sf_readf_float(file, heard.data(), info.frames), info.frames);
    sf_close(file);
    EXPECT_NEAR(static_cast<double>(info.frames), 48000, 3 * 1152);
    double energy = 0, heard_energy = 0;
    for (const float sample : sound) energy += static_cast<double>(sample) * static_cast<double>(sample);
    for (const float sample : heard)
        heard_energy += static_cast<double>(sample) * static_cast<double>(sample);
    EXPECT_NEAR(10 * std::log10(heard_energy / energy), 0, 0.5) << "what is masked is left out";
}

TEST_F(Files, MidiOfNothingIsAnEmptyTrack) {
    EXPECT_EQ(read_track(audio::encode_midi({})).size(), 2U);
}

TEST_F(Files, MidiOfBadValuesIsARuntimeError) {
    audio::Note loud = note(1, 0), high = note(1, 0), late = note(1, 25L << 28);
    loud.midi_velocity = 128;
    high.midi_note = 128;
    for (const audio::Note& bad : {loud, high, late})
        EXPECT_THROW((void)audio::encode_midi({bad}), std::runtime_error);
}

}  // namespace
