// Whole runs in real time, in this process, with sensor processes of the program. Nothing here asserts that
// the machine is fast: late samples and frames are allowed where the run says so itself.
#include "realtime/play_realtime.h"

#include <audio/performance.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "files/assets.h"
#include "files/bad_input.h"
#include "kit/kit.h"
#include "play/play_run.h"
#include "strikes/strike_note.h"
#include "temporary_folder.h"

namespace app {
namespace {

namespace fs = std::filesystem;

/// The first seconds of the bundled flourish.
fs::path cut_flourish(const TemporaryFolder& folder, double until_s) {
    std::ifstream in(find_trace("flourish"));
    std::ofstream out(folder.path() / "cut.csv");
    for (std::string line; std::getline(in, line);)
        if (!std::isdigit(static_cast<unsigned char>(line[0])) || std::stod(line) < until_s)
            out << line << '\n';
    return folder.path() / "cut.csv";
}

RealtimeOptions options_of(const TemporaryFolder& folder, const fs::path& trace, double seconds) {
    RealtimeOptions options;
    options.play.trace = trace;
    options.play.kit = find_kit("drums");
    options.play.out = folder.path() / "out";
    options.play.frames = false;
    options.play.workers = 0;
    options.play.width = 160, options.play.height = 120;
    options.seconds = seconds;
    options.sensors.program = MUSICWORLD_PROGRAM;
    return options;
}

RealtimeOutcome run(const RealtimeOptions& options, std::vector<std::string>* warnings = nullptr) {
    return play_realtime(options, [&](const std::string& line) {
        if (warnings) warnings->push_back(line);
    });
}

/// The sound of the notes that were played, rendered offline.
std::vector<float> offline_sound(const RealtimeOutcome& outcome) {
    const Kit kit = read_kit(outcome.play.options.kit);
    audio::Performance performance(orchestra_file(), voices_of(kit), mix_of(outcome.play.options, kit));
    for (const Strike& strike : outcome.play.strikes)
        if (strike.outcome == Outcome::released)
            performance.schedule(note_of(strike, kit.instruments[strike.instrument]));
    const double length = (outcome.realtime.seconds + kSoundTailS) * audio::kSampleRate;
    return performance.finish(static_cast<std::int64_t>(std::ceil(length)),
                              static_cast<std::int64_t>(kLongestSoundTailS * audio::kSampleRate));
}

TEST(PlayRealtime, ALoopedTraceSoundsAsPlannedToTheSampleAndDepartsFromOfflineOnlyByDelays) {
    const TemporaryFolder folder;
    const bool thorough = std::getenv("MUSICWORLD_LONG") != nullptr;
    const fs::path trace = thorough ? find_trace("flourish") : cut_flourish(folder, 2.2);
    // A machine that holds up the run at some moment: strikes come too late to sound, or are changed when they are rendered already.
    const auto held_up = [](const RealtimeOutcome& outcome) {
        return std::ranges::any_of(outcome.realtime.samples, [](const SampleTiming& sample) {
            return sample.late_s > 0 || sample.skipped > 0;
        });
    };
    RealtimeOutcome outcome = run(options_of(folder, trace, thorough ? 60 : 5.2));
    for (int more = 0; more < 3 && held_up(outcome); ++more)
        outcome = run(options_of(folder, trace, thorough ? 60 : 5.2));
    if (!held_up(outcome)) {
        EXPECT_EQ(outcome.realtime.refused_changes, 0U);
        ASSERT_GE(outcome.realtime.notes.size(), 20U);
    }
    EXPECT_GE(outcome.realtime.laps, 3U);
    // The recording is what the offline sound makes of the same notes: every onset where events.csv says.
    if (outcome.realtime.refused_changes == 0) {
        EXPECT_TRUE(std::ranges::equal(outcome.play.sound.samples, offline_sound(outcome)));
    }
    for (const NoteTiming& note : outcome.realtime.notes) {
        const Strike& strike = outcome.play.strikes[note.strike];
        EXPECT_EQ(strike.id, note.played.id);
        EXPECT_EQ(strike.outcome, Outcome::released);
        EXPECT_EQ(strike.onset_sample, note.played.onset_sample);
    }
    EXPECT_GT(outcome.offline.offline_strikes, 0U);
    for (const Divergence& departure : outcome.offline.departures) {
        EXPECT_NE(departure.cause, "unexplained") << departure.what << " " << departure.offline_onset_s;
        if (departure.cause != "the run ended") {
            EXPECT_GT(departure.delay_s, 0.0033);
        }  // what the margin leaves
    }
}

TEST(PlayRealtime, FramesAreInTimeOrDroppedAndTheFolderHasOneForEach) {
    const TemporaryFolder folder;
    RealtimeOptions options = options_of(folder, cut_flourish(folder, 1.6), 0);
    options.play.frames = true;
    options.play.audio = false;
    const RealtimeOutcome outcome = run(options);
    ASSERT_GE(outcome.realtime.frames.size(), 40U);  // 1.592 s at 30 a second
    std::size_t in_time = 0;
    for (const FrameTiming& frame : outcome.realtime.frames) {
        if (frame.fate == FrameFate::skipped) continue;
        EXPECT_EQ(frame.fate == FrameFate::in_time, frame.read_ns <= frame.shown_ns) << frame.index;
        in_time += frame.fate == FrameFate::in_time;
        // Causal: no frame shows what was not known a render lead before.
        if (frame.fate == FrameFate::in_time && frame.oldest_sample_age_s > 0) {
            EXPECT_GE(frame.oldest_sample_age_s, frame.lead_s - 0.0084);
        }
    }
    if (in_time == 0)
        GTEST_SKIP() << "a machine that draws no frame of 160x120 in 33 ms cannot run this test";
    for (std::size_t k = 0; k < outcome.play.frames; ++k)
        EXPECT_TRUE(fs::exists(options.play.out / "frames" / fmt::format("{:06}.png", k))) << k;
}

TEST(PlayRealtime, StalledAndEndedSensorsAreSaidAndTheRunGoesOn) {
    const TemporaryFolder folder;
    RealtimeOptions options = options_of(folder, cut_flourish(folder, 1.6), 2.5);
    options.disturbance = parse_artificial_load("stall:150@0.7");
    std::vector<std::string> warnings;
    const RealtimeOutcome outcome = run(options, &warnings);
    const auto said = [&](const char* words) {
        return std::ranges::any_of(warnings,
                                   [&](const std::string& line) { return line.find(words) != line.npos; });
    };
    EXPECT_TRUE(said("silent for"));
    EXPECT_TRUE(said("back after"));
    EXPECT_GT(outcome.realtime.samples.back().due_ns, 2'000'000'000);
    for (const Divergence& departure : outcome.offline.departures)
        EXPECT_NE(departure.cause, "unexplained") << departure.lap << " " << departure.what << " "
                                                  << departure.offline_onset_s << " " << departure.onset_s;
}

TEST(PlayRealtime, ALiveRunWithoutASampleFailsAndLeavesNothing) {
    const TemporaryFolder folder;
    RealtimeOptions options = options_of(folder, find_trace("flourish"), 1);
    options.sensors.source = "zmq:ipc://" + (folder.path() / "nobody").string();
    try {
        (void)run(options);
        ADD_FAILURE() << "a run that has nothing to show counts as one";
    } catch (const BadInput&) {
        ADD_FAILURE() << "the options are fine";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("no sample came from zmq:ipc://"), std::string::npos)
            << error.what();
    }
    EXPECT_FALSE(fs::exists(options.play.out));
}

TEST(PlayRealtime, ATraceMayBeGivenAsTheSource) {
    const TemporaryFolder folder;
    RealtimeOptions options = options_of(folder, find_trace("flourish"), 1);
    options.sensors.source = "trace:" + cut_flourish(folder, 1).string();
    EXPECT_EQ(run(options).play.trace, (folder.path() / "cut.csv").string());
}

TEST(PlayRealtime, WhatCannotBeIsRefusedBeforeAnythingStarts) {
    const TemporaryFolder folder;
    const fs::path trace = cut_flourish(folder, 1);
    const auto refused = [&](auto change) {
        RealtimeOptions options = options_of(folder, trace, 1);
        change(options);
        EXPECT_THROW((void)run(options), BadInput);
        EXPECT_FALSE(fs::exists(options.play.out / "summary.json"));
    };
    refused([](RealtimeOptions& o) { o.sound.output_lead_s = o.play.release_margin_s; });
    refused([](RealtimeOptions& o) { o.play.solo = 1; });
    refused([](RealtimeOptions& o) { o.play.sound_predictor = "exec:"; });
    refused([](RealtimeOptions& o) { o.sensors.source = "carrier-pigeon:1"; });
}

}  // namespace
}  // namespace app
