#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "renderer.h"
#include "rendering.h"

namespace {

using namespace rendering;

TEST(Mix, TwoNotesTogetherAreTheSumOfEachAloneToFloatRounding) {
    for (const std::string& instrument : kInstruments) {
        const std::vector<audio::Voice> voices{voice(instrument, {}, 0.3),
                                               voice("drum", {{"snare", 1}}, 0.8)};
        const auto first = note(1, 100, 6), second = note(2, 700, 4, 1), third = note(3, 1800, 2);
        const std::int64_t length = 48000;
        const auto together = render(voices, {first, second, third}, length, 0);
        const auto a = render(voices, {first}, length, 0), b = render(voices, {second}, length, 0),
                   c = render(voices, {third}, length, 0);
        for (std::size_t i = 0; i < together.size(); ++i) {
            // Four roundings to float of values below 1: 4 * 2^-25.
            ASSERT_NEAR(together[i], a[i] + b[i] + c[i], 1.2e-7) << instrument << " at " << i;
        }
    }
}

TEST(Mix, NotesOfOneVoiceDoNotDependOnThoseBefore) {
    // A stroke reuses Csound's memory of an ended one: it must sound as the first did.
    const std::vector<audio::Voice> voices{
        voice("drum", {{"decay_s", 0.1}, {"snare", 0.5}, {"variation", 0}})};
    const auto sound = render(voices, {note(1, 64), note(2, 64 + 64 * 500), note(3, 64 + 64 * 1000)});
    for (std::size_t i = 0; i < 2 * 64 * 100; ++i) {
        ASSERT_EQ(sound[2 * 64 + i], sound[2 * 64 + i + 2 * 64 * 500]);
        ASSERT_EQ(sound[2 * 64 + i], sound[2 * 64 + i + 2 * 64 * 1000]);
    }
}

TEST(Mix, PanKeepsPowerConstantAndReachesBothSides) {
    for (double pan = 0; pan <= 1; pan += 0.125) {
        const audio::PanGains gains = audio::pan_gains(pan, 6.0);
        EXPECT_NEAR(gains.left * gains.left + gains.right * gains.right, std::pow(10.0, 0.6), 1e-12);
    }
    const auto power = [](double pan) {
        const auto sound = render({voice("drum", {}, pan)}, {note(1, 0)}, 24000, 0);
        double sum = 0;
        for (const float x : sound) sum += static_cast<double>(x) * x;
        return sum;
    };
    const double centre = power(0.5);
    for (const double pan : {0.0, 0.2, 1.0})
        EXPECT_NEAR(power(pan) / centre, 1, 1e-6) << pan;  // float rounding
    const auto hard_left = render({voice("drum", {}, 0)}, {note(1, 0)}, 24000, 0);
    for (std::size_t i = 1; i < hard_left.size(); i += 2) ASSERT_NEAR(hard_left[i], 0, 1e-15);
}

TEST(Mix, GainOfMinus6Point02DbHalvesTheSound) {
    audio::Voice half = voice("bell");
    half.gain_db = 20 * std::log10(0.5);
    const auto full = render({voice("bell")}, {note(1, 5)}, 9600, 0),
               soft = render({half}, {note(1, 5)}, 9600, 0);
    for (std::size_t i = 0; i < full.size(); ++i) ASSERT_NEAR(soft[i], full[i] / 2, 1e-8);
}

TEST(Mix, SeventyOverlappingVoicesSound) {
    std::vector<audio::Note> notes;
    for (std::uint64_t id = 1; id <= 70; ++id)
        notes.push_back(note(id, static_cast<std::int64_t>(10 * id), 0.5));
    const auto sound = render({voice("bell")}, notes, 24000, 0);
    const auto one = render({voice("bell")}, {notes.back()}, 24000, 0);
    const auto last = static_cast<std::size_t>(2 * notes.back().onset_sample);
    const auto before = render({voice("bell")}, {notes.begin(), notes.end() - 1}, 24000, 0);
    for (std::size_t i = last; i < sound.size(); ++i) ASSERT_NEAR(sound[i] - before[i], one[i], 1e-6);
}

class Choke : public testing::Test {
protected:
    // The fading voice alone in the left channel, the choking one in the right.
    const std::vector<audio::Voice> voices_{voice("cymbal", {{"decay_s", 4}}, 0, "hat"),
                                            voice("cymbal", {{"decay_s", 0.1}}, 1, "hat"),
                                            voice("cymbal", {{"decay_s", 0.1}}, 1, "other")};
    static constexpr std::int64_t kFade = 720;  // 15 ms
};

TEST_F(Choke, ANewNoteFadesItsGroupsOlderOnesFromItsOnsetToExactZeroWithin15Ms) {
    for (const std::int64_t at : {9600, 9601, 9631, 9632, 9663, 12345}) {
        const auto free = left(render(voices_, {note(1, 0, 8)}, 24000, 0));
        const auto choked = left(render(voices_, {note(1, 0, 8), note(2, at, 3, 1)}, 24000, 0));
        for (std::int64_t i = 0; i < 24000; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const double left_over = std::clamp(1 - static_cast<double>(i - at) / kFade, 0.0, 1.0);
            // Smooth step; 1e-9 + float rounding. The far end tolerates the right voice's cos(pi/2) = 6e-17.
            ASSERT_NEAR(choked[k], free[k] * left_over * left_over * (3 - 2 * left_over), 1e-7)
                << at << " " << i;
        }
    }
}

TEST_F(Choke, NotesWithinOneBlockChokeEachOtherAtTheirOwnOnsets) {
    const auto free = left(render(voices_, {note(1, 6400, 8)}, 24000, 0));
    const auto choked = left(render(voices_, {note(1, 6400, 8), note(2, 6410, 3, 1)}, 24000, 0));
    for (std::size_t i = 6400; i < 6410; ++i) ASSERT_EQ(choked[i], free[i]);
    for (std::size_t i = 6410 + kFade; i < 24000; ++i) ASSERT_NEAR(choked[i], 0, 1e-15);
}

TEST_F(Choke, OtherGroupsEqualOnsetsAndEarlierNotesDoNotChoke) {
    const auto free = left(render(voices_, {note(1, 6400, 8)}, 24000, 0));
    const auto other = left(render(voices_, {note(1, 6400, 8), note(2, 9000, 3, 2)}, 24000, 0));
    const auto together = left(render(voices_, {note(1, 6400, 8), note(2, 6400, 3, 1)}, 24000, 0));
    const auto earlier = left(render(voices_, {note(1, 6400, 8), note(2, 6390, 3, 1)}, 24000, 0));
    for (std::size_t i = 0; i < free.size(); ++i) {
        ASSERT_NEAR(other[i], free[i], 1e-15);
        ASSERT_NEAR(together[i], free[i], 1e-15);
        ASSERT_NEAR(earlier[i], free[i], 1e-15);
    }
}

TEST_F(Choke, ACancelledChokingNoteLeavesNoTrace) {
    audio::Performance performance(kOrchestra, voices_);
    performance.schedule(note(1, 0, 8));
    performance.schedule(note(2, 9000, 3, 1));
    performance.advance_to(9000);
    performance.cancel(2);
    EXPECT_EQ(performance.finish(24000, 0), render(voices_, {note(1, 0, 8)}, 24000, 0));
}

TEST_F(Choke, AHundredChokesInARowLeaveOnlyTheLast) {
    std::vector<audio::Note> notes;
    for (std::uint64_t id = 1; id <= 100; ++id)
        notes.push_back(note(id, static_cast<std::int64_t>(1000 * id), 5));
    const auto sound = left(render(voices_, notes, 110000, 0));
    const auto last = left(render(voices_, {notes.back()}, 110000, 0));
    for (std::size_t i = 100000 + kFade; i < sound.size(); ++i) ASSERT_NEAR(sound[i], last[i], 1e-7);
}

}  // namespace
