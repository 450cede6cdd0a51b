#include "latency/latency_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "sample_realtime.h"
#include "temporary_folder.h"

namespace app {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kMs = 1'000'000;

/// 100 samples whose stages take 1 to 100 ms times their place, 100 frames at 100 a second, 100 blocks.
struct SampleRun {
    PlayResult play;
    RealtimeResult realtime;
    Kit kit = sample::one_drum();

    SampleRun() {
        play.trace = "take.csv";
        play.kit_name = "one drum";
        play.sticks = {"left, \"hand\""};
        play.instruments = {"snare"};
        realtime.seconds = 1;
        realtime.output_lead_s = 0.004;
        realtime.audio_device = "file only";
        add_samples();
        add_frames();
        for (std::int64_t i = 1; i <= 100; ++i) realtime.blocks.push_back({i, i, i + i * kMs / 20});
        sample::draw(realtime, sample::falling(0.493, sample::touch_height(kit), 2), 0.4, 0.6);
        sample::sound(play, realtime, {0.5, 0.9});
        realtime.notes[1].late_s = 0.002;
        realtime.leads.push_back({0.25, 0.03, 0.06, 0.02, 0.01, 0, 30});
        realtime.changes.push_back("frames are late: no shadows");
        realtime.leads.push_back({0.5, 0.04, 0.06, 0.03, 0.01, 1, 30, 0});
    }
    void add_samples() {
        for (std::int64_t i = 1; i <= 100; ++i) {
            SampleTiming s;
            s.t_s = 0.01 * static_cast<double>(i);
            s.due_ns = i * 10 * kMs;
            s.read_ns = s.due_ns + i * kMs / 2;
            s.filtered_ns = s.due_ns + i * kMs;
            s.taken_ns = s.filtered_ns + 2 * i * kMs;
            s.contact_ns = s.taken_ns + 3 * i * kMs;
            s.handed_ns = s.contact_ns + 4 * i * kMs;
            s.query_ns = i;
            s.late_s = i > 97 ? 1e-3 : -1e-3;
            realtime.samples.push_back(s);
        }
    }
    /// Query 1 ms, drawing 2, reading 3, 5 ms more for the last; the last is late, the one before skipped,
    /// the first was not asked for.
    void add_frames() {
        for (std::int64_t i = 0; i < 100; ++i) {
            FrameTiming f;
            f.index = static_cast<std::uint64_t>(i);
            f.shown_ns = i * 10 * kMs;
            f.query_ns = kMs;
            f.started_ns = f.shown_ns - 20 * kMs;
            f.drawn_ns = f.started_ns + 2 * kMs;
            f.read_ns = f.drawn_ns + 3 * kMs;
            f.oldest_sample_age_s = 0.03;
            if (i % 2 == 0) f.written_ns = f.read_ns + 7 * kMs;
            realtime.frames.push_back(f);
        }
        realtime.frames[0].asked_for = false;
        realtime.frames[0].fate = FrameFate::skipped;
        realtime.frames[98].fate = FrameFate::skipped;
        realtime.frames[99].fate = FrameFate::late;
        realtime.frames[99].read_ns += 5 * kMs;
    }
    [[nodiscard]] LatencyReport report() const {
        return latency_report(play, realtime, kit, sample::kTipRadius);
    }
};

double p(const LatencyReport& report, const char* stage, double percent) {
    const LatencyStage* found = find_stage(report, stage);
    EXPECT_NE(found, nullptr) << stage;
    return found == nullptr ? -1 : found->ms.percentile(percent);
}

constexpr double kRounding = 1e-9;  // ns to ms

TEST(Spread, IsLinearBetweenTheOrderedValues) {
    std::vector<double> values;
    for (int i = 100; i >= 1; --i) values.push_back(i);
    const Spread spread(values);
    EXPECT_EQ(spread.percentile(50), 50.5);
    EXPECT_NEAR(spread.percentile(99), 99.01, kRounding);
    EXPECT_NEAR(spread.percentile(99.5), 99.505, kRounding);
    EXPECT_NEAR(spread.percentile(5), 5.95, kRounding);
    EXPECT_EQ(spread.percentile(100), 100);
    EXPECT_EQ(spread.share_within(10, 19), 0.1);
    EXPECT_EQ(Spread({7}).percentile(1), 7);
    EXPECT_TRUE(std::isnan(Spread().percentile(99)));
}

TEST(LatencyReport, SaysHowLongEachStageOfASampleTook) {
    const LatencyReport report = SampleRun().report();
    EXPECT_NEAR(p(report, "sensor to filter", 50), 50.5, kRounding);
    EXPECT_NEAR(p(report, "filter to app", 99), 198.02, kRounding);
    EXPECT_NEAR(p(report, "contact", 95), 285.15, kRounding);
    EXPECT_NEAR(p(report, "note hand-over", 100), 400, kRounding);
    EXPECT_NEAR(p(report, "sample to notes", 50), 505, kRounding);
    EXPECT_NEAR(p(report, "query", 99), 99.01e-6, kRounding);
    EXPECT_NEAR(p(report, "block computed", 99), 99.01 / 20, kRounding);
}

TEST(LatencyReport, SaysHowLongEachStageOfAFrameThatWasDrawnTook) {
    const LatencyReport report = SampleRun().report();
    EXPECT_NEAR(p(report, "frame query", 50), 1, kRounding);
    EXPECT_NEAR(p(report, "frame drawn", 50), 2, kRounding);
    EXPECT_NEAR(p(report, "frame read back", 50), 3, kRounding);
    EXPECT_NEAR(p(report, "frame read back", 100), 8, kRounding);
    EXPECT_NEAR(p(report, "frame in all", 50), 6, kRounding);
    EXPECT_NEAR(p(report, "frame written", 50), 7, kRounding);
    EXPECT_EQ(find_stage(report, "frame drawn")->ms.count(), 98U);
    EXPECT_EQ(find_stage(report, "frame written")->ms.count(), 48U);  // even ones but 0 and 98
    EXPECT_NEAR(p(report, "pose age in frames", 50), 30, kRounding);
    EXPECT_NEAR(p(report, "pose age in notes", 50), 50, kRounding);
}

TEST(LatencyReport, CountsDeadlines) {
    const LatencyReport report = SampleRun().report();
    EXPECT_EQ(report.frames.total, 99U);
    EXPECT_EQ(report.frames.missed, 2U);
    EXPECT_EQ(report.frames_left_out, 1U);
    EXPECT_EQ(report.samples.missed, 3U);
    EXPECT_EQ(report.notes.total, 2U);
    EXPECT_EQ(report.notes.missed, 1U);
    EXPECT_EQ(report.blocks.missed, 20U);  // done more than 4 ms after the plan: 4.05 to 5 ms
}

/// 807 of 2400 samples skipped, 3 of 12 strokes missed: what the run did not do stands wherever it is shown.
TEST(LatencyReport, SkippedSamplesAndMissedStrokesStandInEveryForm) {
    const TemporaryFolder folder;
    SampleRun run;
    run.realtime.samples[10].skipped = 800;
    run.realtime.samples[50].skipped = 7;
    run.play.score.true_contacts = 12;
    run.play.score.missed = 3;
    const LatencyReport report = run.report();
    EXPECT_EQ(report.skipped.total, 907U);
    const std::string text = format_latency_text(report, run.realtime);
    const auto row = [&](const std::string& name) {  // words, one blank between them
        const std::size_t at = text.find("\n" + name + " ");
        if (at == std::string::npos) return "no " + name;
        std::istringstream words(text.substr(at + 1, text.find('\n', at + 1) - at - 1));
        std::string line;
        for (std::string word; words >> word;) line += ' ' + word;
        return line;
    };
    EXPECT_TRUE(row("samples seen").ends_with(" 907 100 807")) << row("samples seen");
    EXPECT_TRUE(row("strokes").ends_with(" 12 9 3")) << row("strokes");
    app::Plotter plotter(folder.path());
    const std::string page = format_latency_page(report, run.play, run.realtime, plotter);
    EXPECT_NE(page.find("<b>807 of 907</b><span>samples skipped"), std::string::npos);
    EXPECT_NE(page.find("<b>3 of 12</b><span>strokes missed"), std::string::npos);
    const Json json = Json::parse(format_latency_json(report, run.play, run.realtime));
    EXPECT_EQ(json["samples"]["skipped"], 807);
    EXPECT_EQ(json["strokes"]["missed"], 3);
}

TEST(LatencyReport, OneLapIsOneLap) {
    SampleRun run;
    EXPECT_TRUE(format_latency_text(run.report(), run.realtime).starts_with("1.0 s, 1 lap, file only\n"));
    run.realtime.laps = 2;
    EXPECT_TRUE(format_latency_text(run.report(), run.realtime).starts_with("1.0 s, 2 laps, "));
}

TEST(LatencyReport, SaysWhichLeadsWouldDo) {
    const LatencyReport report = SampleRun().report();
    EXPECT_NEAR(*report.render_lead_needed_ms, 6.15, kRounding);  // 97 of 6 ms, the late one of 11
    EXPECT_NEAR(*report.sound_lead_needed_ms, 990.1 + 4 + 99.01 / 20, kRounding);
}

TEST(LatencyReport, ComparesSoundAndPicture) {
    const LatencyReport report = SampleRun().report();
    ASSERT_EQ(report.pictures.size(), 1U);
    EXPECT_EQ(report.notes_without_picture, 1U);
    EXPECT_NEAR(report.sound_minus_picture_ms.percentile(50), 7, 1e-5);
    EXPECT_EQ(report.share_within(kAtscLimits), 1);
    EXPECT_EQ(report.share_within({-15, 6}), 0);
    const std::string text = format_latency_text(report, SampleRun().realtime);
    EXPECT_NE(
        text.find("of the notes with a picture, within ATSC's -15 to +45 ms: 100.0 %, within ITU-R BT.1359's "
                  "-45 to +125 ms: 100.0 %\n"),
        std::string::npos)
        << text;
}

TEST(LatencyReport, OfARunWithoutAnythingHasNoFigures) {
    SampleRun run;
    run.realtime = RealtimeResult();
    const LatencyReport report = run.report();
    EXPECT_TRUE(report.stages.empty());
    EXPECT_FALSE(report.render_lead_needed_ms);
    EXPECT_FALSE(report.sound_lead_needed_ms);
    const Json json = Json::parse(format_latency_json(report, run.play, run.realtime));
    EXPECT_TRUE(json["sound_minus_picture_ms"]["median"].is_null());
    EXPECT_TRUE(json["lead_needed_ms"]["render"].is_null());
    EXPECT_TRUE(json["sound_minus_picture_ms"]["share_within_atsc"].is_null());
    EXPECT_TRUE(json["sound_minus_picture_ms"]["share_within_itu"].is_null());
    const std::string text = format_latency_text(report, run.realtime);
    EXPECT_EQ(text.find("ATSC"), std::string::npos) << text;
}

TEST(LatencyJson, HasTheKeysThatScriptsRelyOn) {
    const SampleRun run;
    const Json json = Json::parse(format_latency_json(run.report(), run.play, run.realtime));
    ASSERT_FALSE(json["stages"].empty());
    for (const Json& stage : json["stages"])
        for (const char* key : {"name", "p50_ms", "p95_ms", "p99_ms", "max_ms"})
            EXPECT_TRUE(stage.contains(key)) << key;
    EXPECT_EQ(json["frames"]["total"], 99);
    EXPECT_EQ(json["frames"]["missed"], 2);
    EXPECT_EQ(json["notes"]["total"], 2);
    EXPECT_EQ(json["notes"]["late"], 1);
    for (const char* key : {"p5", "median", "p95", "min", "max"})
        EXPECT_NEAR(json["sound_minus_picture_ms"][key].get<double>(), 7, 1e-5) << key;
    EXPECT_NEAR(json["lead_needed_ms"]["render"].get<double>(), 6.15, kRounding);
    EXPECT_GT(json["lead_needed_ms"]["sound"].get<double>(), 900);
    EXPECT_EQ(json["leads"][1]["why"], "frames are late: no shadows");
}

/// Rows of a table without quoted line breaks, the header first.
std::vector<std::string> lines_of(const std::string& csv) {
    std::vector<std::string> lines;
    std::istringstream in(csv);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

std::ptrdiff_t fields(const std::string& line) {
    bool quoted = false;
    std::ptrdiff_t count = 1;
    for (const char c : line) {
        if (c == '"') quoted = !quoted;
        count += c == ',' && !quoted;
    }
    return count;
}

TEST(LatencyTables, HaveARowForEverythingThatWasTimed) {
    const SampleRun run;
    const LatencyReport report = run.report();
    const std::map<std::string, std::size_t> rows_of = {
        {"samples.csv", 100}, {"frames.csv", 100}, {"notes.csv", 2},
        {"blocks.csv", 100},  {"leads.csv", 2},    {"errors.csv", report.errors.size()}};
    const auto tables = latency_rows(report, run.play, run.realtime);
    EXPECT_EQ(tables.size(), rows_of.size());
    for (const auto& [file, table] : tables) {
        const std::vector<std::string> lines = lines_of(table().csv());
        ASSERT_EQ(lines.size(), rows_of.at(file) + 1) << file;
        for (const std::string& line : lines) EXPECT_EQ(fields(line), fields(lines[0])) << line;
    }
}

TEST(LatencyTables, SayWhereANoteHasNoPicture) {
    const SampleRun run;
    const LatencyReport report = run.report();
    const std::vector<std::string> lines =
        lines_of(latency_rows(report, run.play, run.realtime)[2].second().csv());
    EXPECT_FALSE(lines[1].ends_with(",,,"));
    EXPECT_TRUE(lines[2].ends_with(",,,")) << lines[2];
}

TEST(LatencyPage, IsOnePageWithAllPlots) {
    const TemporaryFolder folder;
    const SampleRun run;
    app::Plotter plotter(folder.path());
    const std::string page = format_latency_page(run.report(), run.play, run.realtime, plotter);
    std::size_t plots = 0;
    for (std::size_t at = page.find("<div class=plot>"); at != std::string::npos;
         at = page.find("<div class=plot>", at + 1))
        ++plots;
    EXPECT_EQ(plots, 7U);
    EXPECT_NE(page.find("frames are late: no shadows"), std::string::npos);
    EXPECT_TRUE(page.ends_with("</html>\n"));
}

TEST(LatencyPage, StandsForARunWithoutAnything) {
    const TemporaryFolder folder;
    SampleRun run;
    run.realtime = RealtimeResult();
    app::Plotter plotter(folder.path());
    const std::string page = format_latency_page(run.report(), run.play, run.realtime, plotter);
    EXPECT_NE(page.find("There were no notes;"), std::string::npos);
    EXPECT_TRUE(page.ends_with("</html>\n"));
}

}  // namespace
}  // namespace app
