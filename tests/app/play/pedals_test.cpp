#include "play/pedals.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "files/assets.h"
#include "files/bad_input.h"
#include "temporary_folder.h"

namespace app {
namespace {

const Kit& drums() {
    static const Kit kit = read_kit(find_kit("drums"));
    return kit;
}

std::uint32_t instrument(const std::string& name) {
    const auto found = std::ranges::find(drums().instruments, name, &Instrument::name);
    return static_cast<std::uint32_t>(found - drums().instruments.begin());
}

Pedals moved(const std::string& rows, double t0_s = 0) {
    Pedals pedals(drums(), t0_s);
    for (const PedalMove& move : parse_pedals("t,pedal,value\n" + rows, "FILE.csv", drums()))
        pedals.take(move);
    return pedals;
}

audio::Note stroke(std::int64_t onset) {
    audio::Note note;
    note.voice = instrument("hi-hat"), note.onset_sample = onset, note.midi_note = 42;
    return note;
}

TEST(Pedals, AHiHatThatClosesAtOnceEndsWhatRingsAndSoundsInThatSample) {
    const Pedals pedals = moved("1,hi-hat,1\n2.00001,hi-hat,0\n", 0.5);
    ASSERT_EQ(pedals.notes().size(), 2U);
    const audio::Note &end = pedals.notes()[0].note, &chick = pedals.notes()[1].note;
    EXPECT_TRUE(is_choke(pedals.notes()[0]));
    EXPECT_FALSE(is_choke(pedals.notes()[1]));
    for (const audio::Note& note : {end, chick}) {
        EXPECT_EQ(note.onset_sample, std::llround(1.50001 * 48000));
        EXPECT_EQ(note.voice, instrument("hi-hat"));
    }
    EXPECT_EQ(chick.midi_note, 44);
    EXPECT_NEAR(chick.speed_mps, 0.03 / 0.015, 1e-9);
}

TEST(Pedals, ASlowFallMakesASofterSoundAndAVerySlowOneNone) {
    const auto chick = [](double seconds) {
        std::string rows = "0,hi-hat,1\n";
        for (int i = 1; i <= 20; ++i)
            rows += fmt::format("{},hi-hat,{}\n", 1 + seconds * i / 20, 1 - i / 20.0);
        const Pedals pedals = moved(rows);
        for (const PedalNote& each : pedals.notes())
            if (!is_choke(each)) return each.note.speed_mps;
        return 0.0;
    };
    EXPECT_NEAR(chick(0.06), 0.03 / 0.06, 0.1);  // its beginning is known to a step
    EXPECT_NEAR(chick(0.1), 0.03 / 0.1, 0.04);
    EXPECT_EQ(chick(0.5), 0);
}

TEST(Pedals, AFootThatTremblesOnTheClosedHiHatClosesItOnce) {
    std::string rows = "1,hi-hat,1\n2,hi-hat,0\n";
    for (int i = 0; i < 20; ++i) rows += fmt::format("{},hi-hat,{}\n", 3 + 0.1 * i, i % 2 ? 0.09 : 0.12);
    EXPECT_EQ(moved(rows).notes().size(), 2U);
    EXPECT_EQ(moved(rows + "6,hi-hat,0.2\n7,hi-hat,0.05\n").notes().size(), 4U);
}

TEST(Pedals, ALapsEndAndTheRunsKeepStepsByTime) {
    Pedals pedals(drums(), 0);
    using Kind = PedalMove::Kind;
    pedals.take({Kind::place, 1, instrument("hi-hat"), 1});
    pedals.take({Kind::place, 2.05, instrument("hi-hat"), 0.5});
    pedals.rest(96000);
    pedals.take({Kind::place, 3, instrument("hi-hat"), 0.8});
    pedals.take({Kind::place, 5, instrument("hi-hat"), 0.3});
    pedals.end_at(4 * 48000);
    std::vector<std::int64_t> samples;
    for (const audio::MidiControl& control : pedals.controls()) samples.push_back(control.sample);
    EXPECT_EQ(samples, (std::vector<std::int64_t>{48000, 96000, 98400, 144000}));
}

TEST(Pedals, AStrokeGetsThePlaceAtItsOnsetAndTheOpenNote) {
    const Pedals pedals = moved("1,hi-hat,0.5\n2,hi-hat,1\n3,hi-hat,0\n");
    const double expected[] = {0, 0.5, 0.5, 1, 0};
    const std::int64_t onsets[] = {47999, 48000, 95999, 96000, 144000};
    for (int i = 0; i < 5; ++i) {
        audio::Note note = stroke(onsets[i]);
        pedals.put_on(note);
        EXPECT_EQ(note.pedal, expected[i]) << onsets[i];
        EXPECT_EQ(note.midi_note, expected[i] > 0 ? 46 : 42);
    }
    audio::Note other = stroke(60000);
    other.voice = instrument("ride");
    pedals.put_on(other);
    EXPECT_EQ(other.pedal, 0);
}

TEST(Pedals, ABeaterStrikesAndAHandChokesWhatHasNoPedal) {
    const Pedals pedals = moved("0.5,bass drum,1\n0.6,bass drum,0\n1,crash,1\n1.5,crash,0\n");
    ASSERT_EQ(pedals.notes().size(), 2U);
    EXPECT_EQ(pedals.notes()[0].note.voice, instrument("bass drum"));
    EXPECT_NEAR(pedals.notes()[0].note.speed_mps, 8, 1e-9);
    EXPECT_EQ(pedals.notes()[0].note.midi_velocity, 127);
    EXPECT_EQ(pedals.notes()[0].note.midi_note, 36);
    EXPECT_TRUE(is_choke(pedals.notes()[1]));
    EXPECT_EQ(pedals.notes()[1].note.voice, instrument("crash"));
    EXPECT_EQ(pedals.notes()[0].note.id, kFirstPedalId);
}

TEST(Pedals, MidiMovesThemAndWhatIsWrittenReadsBack) {
    const auto moves = [](int status, int data1, int data2) {
        return moves_of({1.0, static_cast<std::uint8_t>(status), static_cast<std::uint8_t>(data1),
                         static_cast<std::uint8_t>(data2)},
                        drums());
    };
    using Kind = PedalMove::Kind;
    ASSERT_EQ(moves(0xB9, 4, 127).size(), 1U);
    EXPECT_EQ(moves(0xB9, 4, 127)[0].value, 0);
    EXPECT_EQ(moves(0xB0, 4, 0)[0].value, 1);
    for (const int key : {35, 36}) {
        ASSERT_EQ(moves(0x99, key, 127).size(), 1U);
        EXPECT_EQ(moves(0x99, key, 127)[0].kind, Kind::stroke);
        EXPECT_NEAR(moves(0x99, key, 127)[0].value, 8, 1e-9);
    }
    EXPECT_EQ(moves(0x99, 44, 60)[0].kind, Kind::foot);
    EXPECT_EQ(moves(0xA9, 49, 127)[0].kind, Kind::choke);
    for (const auto& [status, key, value] :
         {std::tuple(0xA9, 49, 63), {0x99, 38, 100}, {0x99, 36, 0}, {0x89, 36, 64}, {0xB9, 64, 0}})
        EXPECT_TRUE(moves(status, key, value).empty()) << status << " " << key;

    // A drum module says that it closed as well as where the pedal is: one sound.
    Pedals both(drums(), 0);
    both.take({Kind::place, 0.5, instrument("hi-hat"), 1});
    both.take({Kind::place, 1, instrument("hi-hat"), 0});
    both.take({Kind::foot, 1.01, instrument("hi-hat"), 3});
    EXPECT_EQ(std::ranges::count_if(both.notes(), [](const PedalNote& n) { return !is_choke(n); }), 1);
    for (const PedalNote& each : both.notes())
        EXPECT_EQ(each.note.onset_sample, 48000) << "what comes later would end the sound of the closing";

    const Pedals written = moved("0.5,bass drum,0.8\n1,hi-hat,1\n2,hi-hat,0\n2.5,crash,1\n");
    std::vector<audio::Note> notes;
    for (const PedalNote& each : written.notes()) notes.push_back(each.note);
    const auto bytes = audio::encode_midi(notes, {}, written.controls());
    const TemporaryFolder folder;
    const auto file = folder.write("p.mid", {bytes.begin(), bytes.end()});
    Pedals again(drums(), 10);
    for (const PedalMove& move : read_pedals(file, drums(), 10)) again.take(move);
    ASSERT_EQ(again.notes().size(), written.notes().size());
    for (std::size_t i = 0; i < again.notes().size(); ++i) {
        const audio::Note &a = again.notes()[i].note, &b = written.notes()[i].note;
        EXPECT_EQ(a.voice, b.voice);
        EXPECT_EQ(a.kind, b.kind);
        EXPECT_NEAR(static_cast<double>(a.onset_sample), static_cast<double>(b.onset_sample),
                    26);                             // half a tick
        EXPECT_NEAR(a.speed_mps, b.speed_mps, 0.1);  // a step of velocity
    }
}

TEST(Pedals, WhatLiesOutsideTheTraceIsCountedAndPlacesBeforeItStay) {
    std::vector<PedalMove> moves =
        parse_pedals("\xEF\xBB\xBFt,pedal,value\n0,hi-hat,1\n0.5,bass drum,1\n1,bass drum,1\n9,hi-hat,0\n",
                     "FILE.csv", drums());
    EXPECT_EQ(leave_out(moves, 1, 8), 2U) << "a stroke before it and a move after it";
    ASSERT_EQ(moves.size(), 2U);
    EXPECT_EQ(moves[0].kind, PedalMove::Kind::place);
    EXPECT_EQ(moves[1].t_s, 1);
}

TEST(Pedals, ATipEndsWhatRingsAndPlacesSayWhereThePedalIs) {
    Pedals pedals = moved("1,hi-hat,1\n2,hi-hat,0.4\n");
    const auto hat = instrument("hi-hat");
    pedals.take({PedalMove::Kind::tip, 1.5, hat, 0, 1}, 72010);
    ASSERT_EQ(pedals.notes().size(), 1U);
    const PedalNote& choke = pedals.notes()[0];
    EXPECT_TRUE(is_choke(choke));
    EXPECT_EQ(choke.stick, 1U);
    EXPECT_EQ(choke.note.onset_sample, 72010);
    EXPECT_EQ(pedals.moves(), 2U) << "a stick is no pedal";
    ASSERT_EQ(pedals.places().size(), 2U);
    for (const audio::Note& place : pedals.places()) EXPECT_EQ(place.kind, audio::Note::Kind::pedal);
    EXPECT_EQ(pedals.places()[0].pedal, 1);
    EXPECT_NEAR(pedals.places()[1].pedal, 0.4, 1e-12);
    EXPECT_EQ(pedals.places()[1].onset_sample, 96000);
    pedals.end_at(90000);
    EXPECT_EQ(pedals.places().size(), 1U);
}

TEST(Pedals, WhatIsNoScheduleIsRefusedWithItsPlace) {
    const auto refused = [](const std::string& text) {
        try {
            (void)parse_pedals(text, "FILE.csv", drums());
        } catch (const BadInput& wrong) {
            return std::string(wrong.what());
        }
        return std::string("read");
    };
    EXPECT_EQ(refused(""), "FILE.csv:1:1: error: found no header, expected t,pedal,value");
    EXPECT_EQ(refused("t,pedal\n"), "FILE.csv:1:1: error: found t,pedal, expected the header t,pedal,value");
    EXPECT_EQ(refused("# a line\nt,pedal,value\n1,hi-hat\n"),
              "FILE.csv:3:1: error: found 2 fields, expected t,pedal,value");
    EXPECT_EQ(refused("t,pedal,value\n1,hi-hat,1.5\n"),
              "FILE.csv:2:10: error: found `1.5`, expected a value, 0 to 1");
    EXPECT_EQ(refused("t,pedal,value\nnan,hi-hat,1\n").find("FILE.csv:2:1: error: found `nan`"), 0U);
    EXPECT_EQ(
        refused("t,pedal,value\n1,hihat,1\n"),
        "FILE.csv:2:3: error: found pedal `hihat`, expected an instrument of the kit; the nearest is hi-hat");
    EXPECT_EQ(refused("t,pedal,value\n1,hi-hat,1\n0.5,hi-hat,1\n")
                  .find("FILE.csv:3:1: error: found t 0.5, before 1"),
              0U);
    EXPECT_EQ(refused("t,pedal,value\r\n1,hi-hat,1\r\n"), "read");
}

}  // namespace
}  // namespace app
