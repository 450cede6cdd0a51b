#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rendering.h"
#include "sample_folder.h"

// What ends a sound by hand or pedal, and what a pedal makes of one.

namespace {

using namespace rendering;

audio::Note choke(std::uint64_t id, std::int64_t onset, std::uint32_t voice = 0) {
    audio::Note made = note(id, onset, 0, voice);
    made.kind = audio::Note::Kind::choke;
    return made;
}

audio::Note pressed(std::uint64_t id, std::int64_t onset, double pedal) {
    audio::Note made = note(id, onset, 5);
    made.pedal = pedal;
    return made;
}

const std::vector<audio::Voice> kTwo{voice("cymbal", {{"decay_s", 4}}, 0),
                                     voice("bell", {{"decay_s", 4}}, 0)};
constexpr std::int64_t kFade = 720;  // 15 ms

TEST(HandChoke, AVoiceWithoutAGroupEndsWithin15MsFromTheVerySampleAndNoOtherDoes) {
    const auto free = left(render({kTwo[0]}, {note(1, 100, 8)}, 24000, 0));
    for (const std::int64_t at : {9600, 9631, 9663, 110}) {  // the last within the stroke's first block
        const auto choked = left(render(kTwo, {note(1, 100, 8), choke(2, at)}, 24000, 0));
        for (std::int64_t i = 0; i < 24000; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const double rest = std::clamp(1 - static_cast<double>(i - at) / kFade, 0.0, 1.0);
            ASSERT_NEAR(choked[k], free[k] * rest * rest * (3 - 2 * rest), 1e-7) << at << " " << i;
        }
    }
    const auto bell = left(render(kTwo, {note(1, 100, 8, 1)}, 24000, 0));
    EXPECT_EQ(left(render(kTwo, {note(1, 100, 8, 1), choke(2, 9600)}, 24000, 0)), bell);
    EXPECT_EQ(left(render(kTwo, {choke(2, 99, 1), choke(3, 100, 1), note(1, 100, 8, 1)}, 24000, 0)), bell)
        << "an earlier one and an equal one";
}

/// Largest step of the second difference of samples [begin, end): what a click is.
double roughness(const std::vector<double>& x, std::size_t begin, std::size_t end) {
    double largest = 0;
    for (std::size_t i = begin + 1; i + 1 < end; ++i)
        largest = std::max(largest, std::abs(x[i + 1] - 2 * x[i] + x[i - 1]));
    return largest;
}

TEST(HandChoke, ItMakesNoClickInALowToneThatRings) {
    // 100 Hz: a step would stand out by its second difference, which is the ringing tone's (2 pi f / sr)^2 otherwise. The fade's own
    // second difference is at most 6 / 720^2 of the amplitude, and twice the slopes' product 1.5 / 720 by 2 pi f / sr.
    const audio::Voice tone =
        voice("bell", {{"frequency_hz", 100}, {"partials", 2}, {"decay_s", 10}, {"attack", 0}}, 0);
    for (const std::int64_t at : {24000, 24050, 24111, 24187, 24240}) {
        const auto sound = left(render({tone}, {note(1, 0, 8), choke(2, at)}, 48000, 0));
        const auto from = static_cast<std::size_t>(at);
        const double before = roughness(sound, from - 2400, from),
                     fading = roughness(sound, from - 2, from + 800);
        double amplitude = 0;
        for (std::size_t i = from - 2400; i < from; ++i) amplitude = std::max(amplitude, std::abs(sound[i]));
        const double slope = 2 * 3.14159 * 100 / 48000;
        EXPECT_LE(fading, before + amplitude * (6.0 / (720 * 720) + 2 * 1.5 / 720 * slope)) << at;
        EXPECT_EQ(roughness(sound, from + 721, from + 4800), 0);
    }
}

TEST(HandChoke, ACancelledOneLeavesNoTraceAndLiveSoundsAsOffline) {
    const auto plain = render(kTwo, {note(1, 100, 8)}, 24000, 0);
    audio::Performance performance(kOrchestra, kTwo);
    performance.schedule(note(1, 100, 8));
    performance.schedule(choke(2, 9000));
    performance.advance_to(8000);
    performance.cancel(2);
    EXPECT_EQ(performance.finish(24000, 0), plain);
    Kept kept;
    audio::LivePerformance live(kOrchestra, kTwo, kept.with({}));
    ASSERT_TRUE(live.schedule(note(1, 100, 8)));
    ASSERT_TRUE(live.schedule(choke(2, 9000)));
    EXPECT_EQ(kept.finish(live, 24000, 0), render(kTwo, {note(1, 100, 8), choke(2, 9000)}, 24000, 0));
}

TEST(Pedal, ItsPlaceLeadsFromOneSoundToTheOtherEvenly) {
    audio::Voice hat = voice("cymbal", {{"decay_s", 0.16}, {"variation", 0}}, 0);
    hat.pedal_parameters = {{"decay_s", 2.2}};
    const auto late = [&](double pedal) {  // energy from 0.3 s on
        const auto sound = left(render({hat}, {pressed(1, 0, pedal)}, 48000, 0));
        double sum = 0;
        for (std::size_t i = 14400; i < sound.size(); ++i) sum += sound[i] * sound[i];
        return 10 * std::log10(sum + 1e-30);
    };
    EXPECT_GT(late(0.5), late(0) + 20);
    EXPECT_GT(late(1), late(0.5) + 10);
    hat.parameters[0].second = 2.2;
    audio::Voice plain = voice("cymbal", {{"decay_s", 2.2}, {"variation", 0}}, 0);
    EXPECT_EQ(render({hat}, {pressed(1, 0, 1)}, 48000, 0), render({plain}, {note(1, 0, 5)}, 48000, 0));
    hat.pedal_parameters = {{"no_such", 1}};
    EXPECT_THROW(audio::Performance(kOrchestra, {hat}), std::runtime_error);
}

audio::Note moved(std::uint64_t id, std::int64_t at, double pedal) {
    audio::Note made = note(id, at, 0);
    made.kind = audio::Note::Kind::pedal;
    made.pedal = pedal;
    return made;
}

/// Level of samples [begin, begin + 2400) in dB.
double level_db(const std::vector<double>& x, std::size_t begin) {
    double sum = 0;
    for (std::size_t i = begin; i < begin + 2400; ++i) sum += x[i] * x[i];
    return 10 * std::log10(sum + 1e-30);
}

TEST(Pedal, WhatRingsFollowsItBothWaysAtTheDecayOfItsPlace) {
    // One mode: T60 says exactly how much is left. At rest 2 s, at the far end 8 s, half-way 4 s.
    audio::Voice bar =
        voice("bell", {{"frequency_hz", 400}, {"partials", 2}, {"decay_s", 2}, {"variation", 0}}, 0);
    bar.pedal_parameters = {{"decay_s", 8}};
    const auto fall_db =
        [&](const std::vector<audio::Note>& notes) {  // over 0.3 s, once the other partials are gone
            const auto sound = left(render({bar}, notes, 96000, 0));
            return level_db(sound, 24000) - level_db(sound, 24000 + 14400);
        };
    EXPECT_NEAR(fall_db({pressed(1, 0, 0)}), 60 * 0.3 / 2, 0.3);
    EXPECT_NEAR(fall_db({pressed(1, 0, 0), moved(2, 20000, 1)}), 60 * 0.3 / 8, 0.3)
        << "opened while it rings";
    EXPECT_NEAR(fall_db({pressed(1, 0, 1), moved(2, 20000, 0.5)}), 60 * 0.3 / 4, 0.3) << "half closed";
    EXPECT_NEAR(fall_db({pressed(1, 0, 1), moved(2, 20000, 0), moved(3, 24000, 1)}), 60 * 0.3 / 8, 0.3);
    // It rings on beyond the end that the note had at its beginning, until it falls below -80 dBFS: from the amplitude at
    // 0.5 s, which is the square root of twice the mean square, at 60 dB in 8 s.
    const auto opened = left(render({bar}, {pressed(1, 0, 0), moved(2, 9600, 1)}, 48000, 480000));
    const double amplitude_db = level_db(opened, 24000) + 10 * std::log10(2.0 / 2400);
    EXPECT_NEAR(static_cast<double>(opened.size()) / 48000, 0.525 + (80 + amplitude_db) * 8 / 60, 0.1);
}

TEST(Pedal, AMoveMakesNoStepAndLiveSoundsAsOffline) {
    audio::Voice tone =
        voice("bell",
              {{"frequency_hz", 100}, {"partials", 2}, {"decay_s", 0.5}, {"attack", 0}, {"variation", 0}}, 0);
    tone.pedal_parameters = {{"decay_s", 8}};
    for (const double to : {0.0, 0.3}) {
        const std::vector<audio::Note> notes{pressed(1, 0, 1), moved(2, 24050, to)};
        const auto sound = left(render({tone}, notes, 48000, 0));
        // A decaying sine's envelope bends where its rate changes: by 6.9 (1 / 0.5 s - 1 / 8 s) / sr of the amplitude,
        // in the second difference, beside the tone's own.
        double amplitude = 0;
        for (std::size_t i = 21600; i < 24000; ++i) amplitude = std::max(amplitude, std::abs(sound[i]));
        EXPECT_LE(roughness(sound, 24000, 24800),
                  roughness(sound, 21600, 24000) + amplitude * 6.9 * (1 / 0.5 - 1 / 8.0) / 48000);
        Kept kept;
        audio::LivePerformance live(kOrchestra, {tone}, kept.with({}));
        for (const audio::Note& each : notes) ASSERT_TRUE(live.schedule(each));
        EXPECT_EQ(kept.finish(live, 48000, 0), render({tone}, notes, 48000, 0));
    }
}

/// Voices of a sound that stays at 0.5: a recording, and an instrument of one's own. At rest they fall by 60 dB in 0.5 s, at
/// the far end of their pedal's way in 2 s, half-way in 1 s.
std::vector<audio::Voice> steady_sounds(const SampleFolder& folder) {
    audio::Voice recorded = voice("cymbal", {{"decay_s", 0.5}}, 0),
                 own = voice("gong", {{"decay_s", 0.5}}, 0);
    recorded.samples = samples_of(folder.sound("steady.wav", std::vector<float>(96000, 0.5F)));
    own.own_orchestra =
        folder.text("own.orc",
                    ";@ gong decay_s 1 0.1 10 time in which it falls by 60 dB [s]\ninstr gong\n"
                    "ilevel = 1\namid init 0.5\naside init 0\niwidth = 0\niduration = 2\n$CLOSE\nendin\n");
    for (audio::Voice* each : {&recorded, &own}) each->pedal_parameters = {{"decay_s", 2}};
    return {recorded, own};
}

TEST(Pedal, RecordedSoundsAndOwnInstrumentsAreDampedAsItsPlaceSaysWithoutAStep) {
    const SampleFolder folder;
    for (const audio::Voice& steady : steady_sounds(folder)) {
        const auto sound = [&](double struck_at, const std::vector<audio::Note>& moves) {
            std::vector<audio::Note> notes{pressed(1, 100, struck_at)};
            notes[0].speed_mps = 8;  // the recording's gain is 1
            notes.insert(notes.end(), moves.begin(), moves.end());
            return left(render({steady}, notes, 48000, 0));
        };
        // From 19968 on, a block's first sample, it falls by 60 dB in 0.5 s less what it falls by itself in 2 s; from 30080 on it
        // is as at the onset. Floats of Csound's table and of the sound round to 2^-25.
        const auto damped = sound(1, {moved(2, 19968, 0), moved(3, 30080, 1)});
        for (std::size_t i = 100; i < 48000; ++i) {
            const auto samples = static_cast<double>(std::clamp<std::size_t>(i + 1, 19968, 30080) - 19968);
            ASSERT_NEAR(damped[i], 0.5 * std::pow(0.001, samples / 48000 * (1 / 0.5 - 1 / 2.0)), 1e-7)
                << steady.name << " " << i;
        }
        // Struck half-way, damped, then opened farther: what is gone does not come back.
        const auto opened = sound(0.5, {moved(2, 19968, 0), moved(3, 30080, 1)});
        for (std::size_t i = 100; i + 1 < 48000; ++i) ASSERT_LE(opened[i + 1], opened[i]) << i;
        EXPECT_NEAR(opened.back(), 0.5 * std::pow(0.001, (30080 - 19968) / 48000.0 * (1 / 0.5 - 1 / 1.0)),
                    1e-6);
        EXPECT_EQ(sound(1, {moved(2, 20000, 1)}), sound(1, {})) << "where it is";
        EXPECT_EQ(sound(0, {moved(2, 20000, 1)}), sound(0, {}))
            << "opened: nothing is left that could ring on";
        EXPECT_EQ(sound(0, {}), sound(1, {})) << "the pedal's place alone is no damping";
        Kept kept;
        audio::LivePerformance live(kOrchestra, {steady}, kept.with({}));
        const std::vector<audio::Note> notes{pressed(1, 100, 1), moved(2, 20000, 0.3)};
        for (const audio::Note& each : notes) ASSERT_TRUE(live.schedule(each));
        EXPECT_EQ(kept.finish(live, 48000, 0), render({steady}, notes, 48000, 0));
    }
}

TEST(Bus, BalanceAndRoomSendActOnTheirVoicesAlone) {
    std::vector<audio::Voice> voices{voice("bell", {{"decay_s", 0.2}}), voice("bell", {{"decay_s", 0.2}})};
    const audio::Mix mix{.gain_db = 0, .room = {.t60_s = 0.5, .level_db = -10}};
    const auto played = [&](std::uint32_t which) {
        audio::Performance performance(kOrchestra, voices, mix);
        performance.schedule(note(1, 0, 5, which));
        return performance.finish(48000, 0);
    };
    const auto wet = played(1);
    voices[0].room_send_db = -60, voices[0].balance = -1;
    EXPECT_EQ(played(1), wet);
    const auto dry = played(0);
    for (std::size_t i = 1; i < dry.size(); i += 2) ASSERT_EQ(dry[i], 0) << "the right side, room included";
    voices[0].balance = 2;
    EXPECT_THROW((void)played(0), std::runtime_error);
}

}  // namespace
