#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rendering.h"

namespace {

using namespace rendering;

const std::vector<audio::Voice> kKit{voice("drum", {{"snare", 0.5}}, 0.4),
                                     voice("bell", {{"decay_s", 1}}, 0.7), voice("string", {{"decay_s", 1}}),
                                     voice("cymbal", {{"decay_s", 0.4}}, 0.2, "hat"),
                                     voice("cymbal", {{"decay_s", 1}}, 0.2, "hat")};

/// Deterministic notes over two seconds, on all voices.
std::vector<audio::Note> some_notes(int count) {
    std::mt19937 random(7);
    std::vector<audio::Note> notes;
    for (int i = 0; i < count; ++i) {
        const auto onset = static_cast<std::int64_t>(random() % 96000);
        notes.push_back(note(static_cast<std::uint64_t>(i + 1), onset, 0.2 + (random() % 780) / 100.0,
                             static_cast<std::uint32_t>(random() % kKit.size()), (random() % 101) / 100.0,
                             static_cast<int>(random() % 2)));
    }
    return notes;
}

TEST(Schedule, TwoRunsOf40NotesAreBitIdentical) {
    const auto notes = some_notes(40);
    EXPECT_EQ(render(kKit, notes), render(kKit, notes));
}

TEST(Schedule, ACancelledNoteLeavesTheAudioBitIdenticalToOneNeverScheduled) {
    const auto notes = some_notes(30);
    const auto expected = render(kKit, notes);
    audio::Performance performance(kOrchestra, kKit);
    for (const auto& each : notes) performance.schedule(each);
    for (std::uint64_t id = 100; id < 120; ++id) {
        performance.schedule(
            note(id, 20000 + static_cast<std::int64_t>(id) * 7, 5, static_cast<std::uint32_t>(id % 5)));
    }
    performance.advance_to(20000 + 100 * 7);  // up to the first of them, in the middle of a block
    for (std::uint64_t id = 100; id < 120; ++id) performance.cancel(id);
    EXPECT_EQ(performance.finish(0, kLongTail), expected);
}

TEST(Schedule, AMovedNoteEqualsOneScheduledThereAtFirst) {
    auto notes = some_notes(20);
    audio::Performance performance(kOrchestra, kKit);
    for (const auto& each : notes) performance.schedule(each);
    performance.advance_to(1000);
    for (auto& each : notes) {
        if (each.onset_sample < 2000) continue;
        each.onset_sample += each.id % 2 == 0 ? 333 : -777;
        each.speed_mps *= 1.1;
        performance.schedule(each);
    }
    EXPECT_EQ(performance.finish(0, kLongTail), render(kKit, notes));
}

TEST(Schedule, TheTimingOfTheCallsDoesNotChangeABit) {
    const auto notes = some_notes(40);
    const auto expected = render(kKit, notes);
    std::mt19937 random(11);
    for (const std::int64_t longest_step : {1LL, 50LL, 3000LL, 40000LL}) {
        audio::Performance performance(kOrchestra, kKit);
        auto waiting = notes;
        std::ranges::sort(waiting, {}, &audio::Note::onset_sample);
        std::size_t next = 0;
        for (std::int64_t at = 0; at < (longest_step == 1 ? 5000 : 100000);) {
            const std::int64_t step = 1 + static_cast<std::int64_t>(random()) % longest_step;
            for (; next < waiting.size() && waiting[next].onset_sample < at + step; ++next) {
                performance.schedule(waiting[next]);
            }
            at += step;
            performance.advance_to(at);
        }
        for (; next < waiting.size(); ++next) performance.schedule(waiting[next]);
        EXPECT_EQ(performance.finish(0, kLongTail), expected) << "steps of up to " << longest_step;
    }
}

TEST(Schedule, LaterNotesDoNotChangeWhatCameBefore) {
    const auto alone = render(kKit, {note(1, 100, 5, 4)});
    const auto both = render(kKit, {note(1, 100, 5, 4), note(2, 9001, 5, 3)});
    EXPECT_TRUE(std::equal(alone.begin(), alone.begin() + 2 * 9001, both.begin()));
    EXPECT_NE(alone[2 * 9001], both[2 * 9001]);
}

TEST(Schedule, IdsDoNotChangeTheSound) {
    EXPECT_EQ(render(kKit, {note(1, 100), note(2, 5000, 4, 1)}),
              render(kKit, {note(900, 100), note(3, 5000, 4, 1)}));
}

TEST(Schedule, ChangesBehindTheLineAndUnknownIdsAreLogicErrors) {
    audio::Performance performance(kOrchestra, kKit);
    performance.schedule(note(1, 999));
    performance.schedule(note(2, 1000));
    performance.advance_to(1000);
    EXPECT_THROW(performance.cancel(1), std::logic_error);
    EXPECT_THROW(performance.schedule(note(1, 5000)), std::logic_error);
    EXPECT_THROW(performance.schedule(note(3, 999)), std::logic_error);
    EXPECT_THROW(performance.cancel(77), std::logic_error);
    EXPECT_NO_THROW(performance.cancel(2));
    EXPECT_THROW(performance.cancel(2), std::logic_error);
    EXPECT_NO_THROW(performance.schedule(note(2, 1000)));
    performance.advance_to(500);  // goes back: nothing happens
    EXPECT_THROW(performance.schedule(note(3, 999)), std::logic_error);
    (void)performance.finish(0, 10000);
    EXPECT_THROW(performance.advance_to(20000), std::logic_error);
    EXPECT_THROW((void)performance.finish(0, 0), std::logic_error);
}

TEST(Schedule, ANoteWithoutAVoiceOrWithAnImpossibleValueIsALogicError) {
    audio::Performance performance(kOrchestra, kKit);
    EXPECT_THROW(performance.schedule(note(0, 10)), std::logic_error);
    EXPECT_THROW(performance.schedule(note(1, -1)), std::logic_error);
    EXPECT_THROW(performance.schedule(note(1, 10, std::nan(""))), std::logic_error);
    EXPECT_THROW(performance.schedule(note(1, 10, 1, 5)), std::logic_error);
    EXPECT_THROW(performance.schedule(note(1, 10, 1, 0, 1.5)), std::logic_error);
}

TEST(Schedule, EndsAfterTheLastSampleAboveMinus80DbWithinItsBounds) {
    const std::vector<audio::Voice> bell{voice("bell", {{"decay_s", 2}}, 0.5)};
    const auto sound = render(bell, {note(1, 100)});
    EXPECT_GE(std::max(std::abs(sound.back()), std::abs(sound[sound.size() - 2])), 1e-4F);
    EXPECT_EQ(render(bell, {note(1, 100)}, 48001).size(), std::max<std::size_t>(2 * 48001, sound.size()));
    EXPECT_EQ(render(bell, {note(1, 100)}, 1000, 333).size(), 2U * 1333);
    EXPECT_EQ(render(bell, {}, 777).size(), 2U * 777);
    EXPECT_TRUE(render(bell, {}, 0, 0).empty());
}

TEST(Schedule, AbandonedPerformancesEndWithoutFinish) {
    audio::Performance performance(kOrchestra, kKit);
    performance.schedule(note(1, 10));
    performance.advance_to(48000);
}

TEST(Schedule, TheCallersFloatingPointModeIsLeftAlone) {
    const unsigned before = _mm_getcsr() & 0x8040U;  // FTZ and DAZ
    const auto sound = render(kKit, some_notes(5));
    EXPECT_EQ(_mm_getcsr() & 0x8040U, before);
    EXPECT_FALSE(sound.empty());
}

TEST(Schedule, BusyTimeOfEightyNotesIsReported) {
    std::vector<audio::Note> notes = some_notes(80);
    for (auto& each : notes) each.onset_sample *= 5;
    audio::Performance performance(kOrchestra, kKit);
    for (const auto& each : notes) performance.schedule(each);
    const auto sound = performance.finish(480000, kLongTail);
    const double seconds = static_cast<double>(sound.size()) / (2.0 * audio::kSampleRate);
    RecordProperty("busy_s", std::to_string(performance.busy_s()));
    EXPECT_GT(performance.busy_s(), 0);
    EXPECT_GT(seconds, 10);
}

}  // namespace
