#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "onset_rule.h"
#include "rendering.h"

namespace {

using namespace rendering;

constexpr std::int64_t kBlockSamples = 64;
constexpr std::int64_t kSpacing =
    200 * kBlockSamples + 1;  // 267 ms, so that each note falls one sample later in its block
constexpr int kNotes = 2 * kBlockSamples + 1;  // every phase twice

/// Voices whose softest note ends, at exactly zero, within the spacing.
audio::Voice short_voice(const std::string& instrument) {
    return voice(instrument, {{"decay_s", 0.05}, {"variation", 0}}, 0.35);
}

class Onset : public testing::TestWithParam<std::string> {};

TEST_P(Onset, FirstSampleIsTheOnsetAtEveryPhaseOfTheBlockAndBeforeItIsExactSilence) {
    for (const double speed : {0.2, 8.0}) {
        std::vector<audio::Note> notes;
        for (int i = 0; i < kNotes; ++i)
            notes.push_back(note(static_cast<std::uint64_t>(i + 1), 64 + i * kSpacing, speed));
        const auto sound = left(render({short_voice(GetParam())}, notes, kNotes * kSpacing, 0));
        std::int64_t sounded = -kBlockSamples;  // the last sample before the onset that is not 0
        std::size_t next = 0;
        for (std::int64_t i = 0; i < std::ssize(sound); ++i) {
            const double x = sound[static_cast<std::size_t>(i)];
            if (next < notes.size() && i == notes[next].onset_sample) {
                ASSERT_NE(x, 0) << speed << " m/s, onset " << i;
                ASSERT_LT(sounded, i - kBlockSamples)
                    << "the note before is to be silent a block ahead of the onset";
                ++next;
            }
            if (x != 0) sounded = i;
        }
        EXPECT_EQ(next, notes.size());
    }
}

TEST_P(Onset, ZonesAndPlacesAtTheirExtremesStartAtTheOnset) {
    for (const int zone : {0, 1}) {
        for (const double place : {0.0, 1.0}) {
            const auto sound = left(render({voice(GetParam())}, {note(1, 1234, 0.2, 0, place, zone)}));
            EXPECT_NE(sound.at(1234), 0);
            EXPECT_TRUE(std::all_of(sound.begin(), sound.begin() + 1234, [](double x) { return x == 0; }));
        }
    }
}

TEST_P(Onset, AStrokeSoundsTheSameAtEveryPhaseOfTheBlock) {
    Parameters parameters{{"decay_s", 0.05}, {"variation", 0}};
    if (GetParam() == "drum") parameters.insert(parameters.end(), {{"bend_cents", 0}, {"snare", 0.5}});
    std::vector<audio::Note> notes;
    for (int i = 0; i < kBlockSamples; ++i)
        notes.push_back(note(static_cast<std::uint64_t>(i + 1), 64 + i * kSpacing, 8));
    const auto sound =
        left(render({voice(GetParam(), parameters, 0)}, notes, kBlockSamples * kSpacing + kBlockSamples, 0));
    for (const audio::Note& each : notes) {
        for (std::int64_t i = 0; i < kSpacing; ++i) {
            // Modes come to rest 100 dB below full scale, at the end of a block: up to 32 of them, 1e-5 each.
            ASSERT_NEAR(sound[static_cast<std::size_t>(each.onset_sample + i)],
                        sound[static_cast<std::size_t>(64 + i)], 5e-5)
                << "onset " << each.onset_sample << ", sample " << i;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Instruments, Onset, testing::ValuesIn(kInstruments),
                         [](const auto& each) { return each.param; });

TEST(OnsetRule, ProbeFindsARuleThatIsExactForBlocksOf1And16And64Samples) {
    for (const int block : {1, 16, 64}) EXPECT_NO_THROW((void)audio::probe_onset_rule(block)) << block;
}

TEST(OnsetRule, HalfBlockRuleAsksForTheSecondHalfOneBlockEarlier) {
    EXPECT_DOUBLE_EQ(audio::onset_p2(audio::OnsetRule::half_block, 31, 64), 31.01 / 48000);
    EXPECT_DOUBLE_EQ(audio::onset_p2(audio::OnsetRule::half_block, 32, 64), 32.01 / 48000 - 64.0 / 48000);
    EXPECT_DOUBLE_EQ(audio::onset_p2(audio::OnsetRule::exact, 32, 64), 32.01 / 48000);
}

TEST(OnsetRule, OnsetsOfThePerformancesFirstBlockAreExactToo) {
    for (const std::int64_t onset : {0, 1, 31, 32, 33, 50, 63}) {
        const auto sound = left(render({short_voice("drum")}, {note(1, onset)}));
        EXPECT_EQ(std::find_if(sound.begin(), sound.end(), [](double x) { return x != 0; }) - sound.begin(),
                  onset);
    }
}

TEST(OnsetRule, OnsetsStayExactAfterTenMinutes) {
    const std::int64_t onset = 600 * 48000 + 37;
    const auto sound = left(render({short_voice("drum")}, {note(1, onset)}, 0, onset + kLongTail));
    EXPECT_EQ(std::find_if(sound.begin(), sound.end(), [](double x) { return x != 0; }) - sound.begin(),
              onset);
}

}  // namespace
