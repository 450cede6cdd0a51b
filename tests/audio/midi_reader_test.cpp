#include "audio/midi_reader.h"

#include <gtest/gtest.h>

#include "audio/performance.h"

namespace {

std::string bytes(std::initializer_list<int> values) {
    std::string text;
    for (const int value : values) text.push_back(static_cast<char>(value));
    return text;
}

std::string chunk(const std::string& kind, const std::string& content) {
    const auto size = static_cast<int>(content.size());
    return kind + bytes({0, 0, size >> 8, size & 255}) + content;
}

std::string head(int format, int tracks, int division = 480) {
    return chunk("MThd", bytes({0, format, 0, tracks, division >> 8, division & 255}));
}

const std::string kEnd = bytes({0, 0xFF, 0x2F, 0});

std::string refusal(const std::string& file) {
    try {
        (void)audio::parse_midi(file, "FILE.mid");
    } catch (const std::runtime_error& wrong) {
        return wrong.what();
    }
    return "read";
}

TEST(MidiReader, ReadsBackWhatIsWritten) {
    std::vector<audio::Note> notes;
    for (std::uint64_t i = 0; i < 20; ++i)
        notes.push_back({.id = i + 1, .onset_sample = static_cast<std::int64_t>(i) * 7777});
    notes[3].kind = audio::Note::Kind::choke;
    const std::vector<std::uint8_t> file = audio::encode_midi(notes, {.tempo_bpm = 93}, {{4800, 4, 100}});
    const auto messages =
        audio::parse_midi({reinterpret_cast<const char*>(file.data()), file.size()}, "FILE.mid");
    std::size_t on = 0;
    for (const audio::MidiMessage& message : messages) {
        if (message.kind() == audio::kMidiAftertouch) {
            EXPECT_NEAR(message.t_s, 3 * 7777 / 48000.0, 0.6e-3);  // a tick is 0.52 ms
            EXPECT_EQ(message.data2, 127);
        }
        if (message.kind() == audio::kMidiController) {
            EXPECT_NEAR(message.t_s, 0.1, 0.6e-3);
            EXPECT_EQ(message.data1, 4);
            EXPECT_EQ(message.data2, 100);
        }
        if (message.kind() != audio::kMidiNoteOn) continue;
        if (on == 3) ++on;
        EXPECT_NEAR(message.t_s, static_cast<double>(on++) * 7777 / 48000.0, 0.6e-3);
    }
    EXPECT_EQ(on, 20U);
}

TEST(MidiReader, TemposOfOneTrackHoldForAllAndRunningStatusGoesOn) {
    // 480 ticks are 0.5 s, after the tempo change 1 s.
    const std::string tempi = chunk("MTrk", bytes({0x83, 0x60, 0xFF, 0x51, 3, 0x0F, 0x42, 0x40}) + kEnd);
    const std::string notes =
        chunk("MTrk", bytes({0x83, 0x60, 0x99, 38, 90, 0x83, 0x60, 38, 91, 0, 0xF0, 2, 1, 0xF7}) +
                          bytes({0, 0xC9, 5}) + kEnd);
    const auto messages =
        audio::parse_midi(head(1, 2) + tempi + chunk("XYZW", "anything") + notes, "FILE.mid");
    ASSERT_EQ(messages.size(), 2U) << "programs and system messages are nobody's";
    EXPECT_DOUBLE_EQ(messages[0].t_s, 0.5);
    EXPECT_DOUBLE_EQ(messages[1].t_s, 1.5);
    EXPECT_EQ(messages[1].data2, 91);
    const auto smpte = audio::parse_midi(
        head(0, 1, (256 - 25) << 8 | 40) + chunk("MTrk", bytes({100, 0x99, 38, 90}) + kEnd), "F");
    EXPECT_DOUBLE_EQ(smpte.at(0).t_s, 0.1);
}

TEST(MidiReader, WhatIsNoMidiFileIsRefusedWithItsPlace) {
    EXPECT_EQ(refusal(""), "FILE.mid: error: found the end at byte 0, expected MThd");
    EXPECT_EQ(refusal("RIFFxxxxxxxxxxxx"),
              "FILE.mid: error: found something else at byte 4, expected MThd, the head of a MIDI file");
    EXPECT_NE(refusal(head(2, 1)).find("found format 2 at byte"), std::string::npos);
    EXPECT_NE(refusal(head(0, 1, 0)).find("found a division of 0"), std::string::npos);
    EXPECT_NE(refusal(head(0, 1)).find("found the end at byte 14, expected a track"), std::string::npos);
    EXPECT_NE(refusal(head(0, 1) + chunk("MTrk", bytes({0, 38, 90}))).find("found data byte 38"),
              std::string::npos);
    EXPECT_NE(refusal(head(0, 1) + chunk("MTrk", bytes({0, 0x99, 0x99}))).find("found a byte of 153"),
              std::string::npos);
    EXPECT_NE(refusal(head(0, 1) + chunk("MTrk", bytes({0x80, 0x80, 0x80, 0x80, 0, 0x99, 1, 1})))
                  .find("more than four bytes"),
              std::string::npos);
    EXPECT_NE(
        refusal(head(0, 1) + chunk("MTrk", bytes({0, 0xFF, 0x51, 3, 0, 0, 0}) + kEnd)).find("tempo of 0"),
        std::string::npos);
    std::string notes = bytes({0, 0x99, 38, 90});
    for (int i = 0; i < 1'000'000; ++i) notes += bytes({0, 38, 90});
    const auto size = static_cast<int>(notes.size());
    EXPECT_NE(refusal(head(0, 1) + "MTrk" + bytes({0, size >> 16, size >> 8 & 255, size & 255}) + notes)
                  .find("found more than 1000000 notes"),
              std::string::npos);
    EXPECT_NE(refusal(head(0, 1) + "MTrk" + bytes({0, 0, 1, 0}) + kEnd).find("expected a track of 256"),
              std::string::npos);
}

TEST(MidiReader, CutAtEveryByteItIsRefusedAndNothingElse) {
    const std::string whole =
        head(1, 1) + chunk("MTrk", bytes({0, 0x99, 38, 90, 0x60, 0xFF, 1, 2, 65, 66, 0, 0xB9, 4, 0}) + kEnd);
    EXPECT_EQ(refusal(whole), "read");
    for (std::size_t size = 0; size < whole.size(); ++size)
        EXPECT_EQ(refusal(whole.substr(0, size)).find("FILE.mid: error: found "), 0U) << size;
}

}  // namespace
