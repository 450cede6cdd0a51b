#include "compare/comparison.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "compare/comparison_tables.h"
#include "files/bad_input.h"
#include "sample_recordings.h"
#include "statistics/statistics.h"

namespace {
namespace fs = std::filesystem;

/// Commas of a CSV row outside of quotes.
int columns_after_first(const std::string& row) {
    int commas = 0;
    bool quoted = false;
    for (const char c : row) {
        quoted = quoted != (c == '"');
        commas += !quoted && c == ',';
    }
    return commas;
}

/// Two recordings of strokes in files, and a comparison of them.
class Comparisons : public testing::Test {
protected:
    Comparisons()
        : folder_(fs::temp_directory_path() / ("musicworld_comparison_" + std::to_string(getpid()))) {
        fs::create_directories(folder_);
        for (const int i : {1, 2}) {
            tracking::Trace trace;
            trace.sticks.push_back(sample::stick_of(sample::strokes, 3 + i, 250));
            std::ofstream(folder_ / ("p" + std::to_string(i) + "_strokes.csv"))
                << tracking::format_trace(trace);
        }
        options_.traces = {file("p1_strokes.csv"), file("p2_strokes.csv")};
        options_.predictors = {"hold", "cv", "thesis"};
        options_.leads_s = {1.0 / 30, 0.1};
        options_.sensor.rate_hz = 60;
        options_.sensor.noise_m = 0.00025;
        options_.cost = false;
    }
    ~Comparisons() override { fs::remove_all(folder_); }

    [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }

    fs::path folder_;
    app::ComparisonOptions options_;
};

TEST_F(Comparisons, JsonHasEveryKeyForEveryRecordingStickPredictorAndLead) {
    const auto json = nlohmann::json::parse(app::format_comparison_json(app::compare(options_)));
    for (const char* key : {"settings", "results", "summary", "paired", "winners"})
        EXPECT_TRUE(json.contains(key)) << key;
    int named = 0;
    for (const auto& row : json["results"]) {
        for (const char* key : {"trace", "person", "stick", "predictor", "used", "lead_s", "rate_hz",
                                "noise_mm", "rms_mm", "p95_mm", "free_rms_mm", "rotation_rms_deg",
                                "tip_rms_mm", "ns_per_sample", "hits", "calibration"})
            EXPECT_TRUE(row.contains(key)) << key;
        EXPECT_EQ(row["rate_hz"], 60);
        EXPECT_EQ(row["noise_mm"], 0.25);
        EXPECT_TRUE(row["rotation_rms_deg"].is_null());  // the recordings have no orientation
        EXPECT_TRUE(row["ns_per_sample"].is_null());     // not measured
        EXPECT_TRUE(row["hits"].is_null());              // no surface
        EXPECT_GT(row["rms_mm"], 0);
        EXPECT_LE(row["rms_mm"], row["p95_mm"]);
        named += row["predictor"] == "hold" || row["predictor"] == "cv" || row["predictor"] == "thesis";
    }
    EXPECT_EQ(named, 2 * 1 * 3 * 2);
    EXPECT_EQ(json["settings"]["persons"].size(), 2U);
    EXPECT_EQ(json["winners"].size(), 2U);
}

TEST_F(Comparisons, EveryEstimatorIsPairedWithTheBestBaselineAndTheSentenceNamesTheLeastError) {
    const app::Comparison comparison = app::compare(options_);
    for (const app::PairedResult& paired : comparison.paired) {
        EXPECT_TRUE(paired.predictor.starts_with("cv") || paired.predictor == "thesis") << paired.predictor;
        EXPECT_EQ(paired.by_recording.n, 2U);
        ASSERT_TRUE(paired.by_person.has_value());
        EXPECT_EQ(paired.by_person->ratios.size(), 2U)
            << "two recordings make no interval, of persons neither";
        EXPECT_NEAR(paired.by_recording.ratio, paired.rms_mm / paired.baseline_rms_mm, 1e-12);
        for (const app::ComparisonSummary& summary : comparison.summaries) {
            const bool comparable =
                summary.baseline && summary.lead_s == paired.lead_s && !summary.predictor.ends_with("*");
            EXPECT_TRUE(!comparable || paired.baseline_rms_mm <= summary.error.position.rms() * (1 + 1e-12))
                << summary.predictor;
        }
    }
    EXPECT_EQ(comparison.paired.size(), 2 * 4U);  // cv, thesis, cv*, cv** at two leads
    const auto least = std::min_element(
        comparison.summaries.begin(), comparison.summaries.end(),
        [](const auto& a, const auto& b) { return a.error.position.rms() < b.error.position.rms(); });
    EXPECT_NE(app::winners(comparison)[0].find(least->predictor + " errs least"), std::string::npos);
}

TEST_F(Comparisons, ATieWithABaselineIsNotCalledAWin) {
    app::Comparison comparison = app::compare(options_);
    const double lead_s = comparison.summaries.front().lead_s;
    for (app::ComparisonSummary& summary : comparison.summaries)
        if (summary.lead_s == lead_s) summary.error.position = {1, 1}, summary.hits.reset();
    std::swap(comparison.summaries.front(),
              *std::ranges::find(comparison.summaries, false, &app::ComparisonSummary::baseline));
    ASSERT_FALSE(comparison.summaries.front().baseline);  // else the first of equals would be one anyway
    EXPECT_NE(app::winners(comparison)[0].find("a baseline, no filter does better"), std::string::npos);
}

TEST_F(Comparisons, ResultsDoNotDependOnThreadsOrRuns) {
    const std::string one = app::format_comparison_json(app::compare(options_));
    options_.threads = 3;
    EXPECT_EQ(app::format_comparison_json(app::compare(options_)), one);
}

TEST_F(Comparisons, CostIsMeasuredOnlyWhenAskedFor) {
    options_.cost = true;
    for (const app::ComparisonRow& row : app::compare(options_).rows) {
        EXPECT_GT(row.ns_per_sample, 0) << row.predictor;
        EXPECT_LT(row.ns_per_sample, 1e6) << row.predictor;  // a thousand times what any should take
    }
}

TEST_F(Comparisons, CsvHasARowAResultAndAsManyColumnsAsItsHeader) {
    const app::Comparison comparison = app::compare(options_);
    std::istringstream csv(app::result_table(comparison).csv());
    std::string line, header;
    std::getline(csv, header);
    std::size_t rows = 0;
    for (; std::getline(csv, line); ++rows)
        EXPECT_EQ(columns_after_first(line), columns_after_first(header)) << line;
    EXPECT_EQ(rows, comparison.rows.size());
}

TEST_F(Comparisons, PredictionsFromAFileOfHoldErrAsHoldDoes) {
    // `hold` predicts the sample itself: the file is the sensed samples, a lead later.
    const app::Recording recording = app::read_recording(options_.traces[1]);
    tracking::Trace answers;
    answers.sticks.push_back({"right", tracking::sense(recording.trace.sticks[0], options_.sensor, 0)});
    auto& rows = answers.sticks[0].samples;
    rows.erase(rows.begin());
    for (tracking::PoseSample& row : rows) row.t_s += 0.1;
    std::ofstream(file("mine.csv")) << tracking::format_trace(answers);
    options_.predictions = {{"mine", file("mine.csv")}};
    const app::Comparison comparison = app::compare(options_);
    const auto row_of = [&](const std::string& name) {
        return *std::find_if(
            comparison.rows.begin(), comparison.rows.end(), [&](const app::ComparisonRow& row) {
                return row.predictor == name && row.trace == options_.traces[1] && row.lead_s == 0.1;
            });
    };
    EXPECT_NEAR(row_of("mine").error.position.rms(), row_of("hold").error.position.rms(), 1e-9);
    EXPECT_TRUE(row_of("mine").external);
    EXPECT_EQ(std::count_if(comparison.rows.begin(), comparison.rows.end(),
                            [](const app::ComparisonRow& row) { return row.predictor == "mine"; }),
              1);
    options_.leads_s = {1.0 / 30};
    EXPECT_THROW((void)app::compare(options_), app::BadInput);  // the file's lead is not asked for
}

/// Strokes, two a second, whose fall of 0.3 m gathers speed as time^power: beyond 2 the acceleration itself
/// grows, and a contact comes earlier than who believes it constant predicts.
tracking::StickTrace gathering_strokes(double last_s, double power) {
    return sample::stick_of(
        [=](double t) {
            const double low_to_top = std::abs(std::remainder(t, 0.5)) / 0.25;
            tracking::PoseSample pose;
            pose.position = {0, 0.97 + 0.3 * (1 - std::pow(1 - low_to_top, power)), 0};
            return pose;
        },
        last_s, 250);
}

class Advances : public Comparisons {
protected:
    Advances() {
        for (const int i : {1, 2, 3}) write(i, 2.5);
        options_.traces = {file("p1_gathering.csv"), file("p2_gathering.csv"), file("p3_gathering.csv")};
        options_.predictors = {"auto"};
        options_.leads_s = {1.0 / 15};
        options_.surface.kind = app::StrikeSurface::Kind::plane;
        options_.surface.height_m = 0.98;
        options_.surface_text = "plane 0.98";
    }
    void write(int i, double power) const {
        tracking::Trace trace;
        trace.sticks.push_back(gathering_strokes(4 + i, power));
        std::ofstream(file("p" + std::to_string(i) + "_gathering.csv")) << tracking::format_trace(trace);
    }
    /// What `auto` learned, by trace.
    [[nodiscard]] std::vector<double> learned() const {
        std::vector<double> advances;
        for (const app::ComparisonRow& row : app::compare(options_).rows)
            if (row.predictor == "auto") advances.push_back(row.advance_s.value_or(1));
        return advances;
    }
};

TEST_F(Comparisons, ASensorTooSlowToScoreIsRefused) {
    options_.sensor.rate_hz = 0.1;
    EXPECT_THROW((void)app::compare(options_), app::BadInput);
}

TEST_F(Advances, AreLearnedOnOtherRecordingsOnly) {
    const std::vector<double> before = learned();
    ASSERT_EQ(before.size(), 3U);
    write(1, 4);
    const std::vector<double> after = learned();
    EXPECT_EQ(after[0], before[0]) << "the recording itself has no say";
    EXPECT_NE(after[1], before[1]) << "it has on the others";
    EXPECT_NE(after[2], before[2]);
}

TEST_F(Advances, AreLearnedOnTheTuningRecordingsWhereThereAreAny) {
    options_.traces = {file("p1_gathering.csv"), file("p2_gathering.csv")};
    options_.tune_traces = {file("p3_gathering.csv")};
    const std::vector<double> before = learned();
    write(2, 4);
    EXPECT_EQ(learned(), before) << "the others compared have no say";
    write(3, 4);
    const std::vector<double> after = learned();
    ASSERT_EQ(after.size(), 2U);
    EXPECT_NE(after[0], before[0]) << "those that tune have";
    EXPECT_EQ(after[0], after[1]) << "the same for all";
    options_.traces.resize(1);
    EXPECT_EQ(learned(), std::vector<double>{after[0]}) << "one recording is enough to be scored";
}

TEST_F(Advances, ACopyOfTheRecordingScoredTeachesNothing) {
    options_.traces.resize(1);
    fs::copy_file(file("p1_gathering.csv"), file("copy.csv"));
    options_.tune_traces = {file("copy.csv")};
    EXPECT_EQ(learned(), std::vector<double>{1}) << "none learned";
    options_.predictors = {"cv"};
    const app::Comparison alone = app::compare(options_);
    EXPECT_TRUE(std::all_of(alone.rows.begin(), alone.rows.end(),
                            [](const app::ComparisonRow& row) { return !row.predictor.ends_with("*"); }));
    EXPECT_TRUE(alone.tuned_on.starts_with("nothing is tuned")) << alone.tuned_on;
    options_.tune_traces.push_back(file("p2_gathering.csv"));
    const app::Comparison with_copy = app::compare(options_);
    options_.tune_traces = {file("p2_gathering.csv")};
    const app::Comparison without = app::compare(options_);
    ASSERT_EQ(with_copy.rows.size(), without.rows.size());
    for (std::size_t i = 0; i < without.rows.size(); ++i)
        EXPECT_EQ(with_copy.rows[i].used, without.rows[i].used);
    EXPECT_NE(without.tuned_on.find("1 recording named by --tune"), std::string::npos) << without.tuned_on;
}

TEST_F(Comparisons, HowFarAheadIsToldByTheSameErrorsAndStrikesAsTheLeadsAskedFor) {
    options_.predictors = {"naive", "thesis", "auto", "cv"};
    options_.tuning = false;
    options_.surface.kind = app::StrikeSurface::Kind::above_contact;
    options_.surface.height_m = 0.02;
    options_.surface_text = "plane contact+0.02";
    const app::Comparison comparison = app::compare(options_);
    int told = 0;
    for (const app::LeadCurve& curve : comparison.curves) {
        const auto summary = std::ranges::find_if(comparison.summaries, [&](const auto& s) {
            return s.predictor == curve.predictor && s.lead_s == 0.1;
        });
        ASSERT_NE(summary, comparison.summaries.end());
        const auto error = std::ranges::find(curve.rms_mm, 0.1, &std::pair<double, double>::first);
        ASSERT_NE(error, curve.rms_mm.end());
        EXPECT_NEAR(error->second, summary->error.position.rms(), 1e-9) << curve.predictor;
        EXPECT_EQ(curve.hits.empty(), !app::tells_how_far(curve.predictor)) << curve.predictor;
        if (curve.hits.empty()) continue;
        ++told;
        const auto hits = std::ranges::find(curve.hits, 0.1, &std::pair<double, app::HitScore>::first);
        ASSERT_NE(hits, curve.hits.end());
        EXPECT_EQ(hits->second.errors_ms, summary->hits->errors_ms) << curve.predictor;
        EXPECT_EQ(hits->second.predicted, summary->hits->predicted) << curve.predictor;
    }
    EXPECT_EQ(told, 3);
    EXPECT_EQ(app::how_far_table(comparison).rows.size(), 3U);
    const auto json = nlohmann::json::parse(app::format_comparison_json(comparison));
    EXPECT_EQ(json["lead_curves"]["errors"].size(), comparison.curves.size() * 16);
    EXPECT_EQ(json["lead_curves"]["strikes"].size(), 3U * 9);
}

TEST(LeadCurve, PassesWhereTheLineBetweenItsPointsDoes) {
    app::LeadCurve curve{"auto", {{0, 1}, {0.05, 6}, {0.1, 16}, {0.15, 15}}};
    EXPECT_DOUBLE_EQ(*curve.passes(11), 0.075);
    EXPECT_DOUBLE_EQ(*curve.passes(0.5), 0) << "from the first on";
    EXPECT_EQ(curve.passes(16), std::nullopt);
    app::HitScore good, poor;
    good.true_contacts = good.predicted = good.matched = 10;
    poor.true_contacts = poor.predicted = 10, poor.matched = 5;
    curve.hits = {{0.02, good}, {0.06, poor}};
    EXPECT_NEAR(*curve.falls_below(0.9), 0.028, 1e-12);
    EXPECT_EQ(curve.falls_below(0.4), std::nullopt);
    app::Comparison comparison;
    comparison.curves = {curve, {"cv", {{0, 100}}}, {"naive", {{0, 30}}}};
    EXPECT_EQ(
        app::how_far_sentence(comparison),
        "auto errs by more than 10 mm from 70 ms ahead on, by more than 20 mm nowhere up to 150 ms; naive "
        "errs by more than 10 mm at any lead, by more than 20 mm at any lead.");
}

TEST_F(Comparisons, TransferTrainsOnOnePersonAndScoresTheOther) {
    options_.training.hidden = 8;
    options_.training.steps = 60;
    const std::string folder = folder_.filename();
    const auto compared = [&](std::vector<std::string> transfer) {
        options_.transfer = std::move(transfer);
        return app::compare(options_);
    };
    const app::Comparison by_person = compared({folder + "/p2"});
    const auto rows_by = [&](const std::string& name) {
        return std::ranges::count(by_person.rows, name, &app::ComparisonRow::predictor);
    };
    for (const char* name : {"learned*", "arbitrated*", "cv*", "cv**"}) EXPECT_EQ(rows_by(name), 2) << name;
    for (const app::ComparisonRow& row : by_person.rows) EXPECT_EQ(row.trace, options_.traces[0]);
    EXPECT_NE(by_person.tuned_on.find("on the 1 recording of --transfer"), std::string::npos);
    EXPECT_EQ(by_person.inputs.size(), 2U);
    const std::string text = app::format_comparison_text(by_person);
    EXPECT_EQ(app::format_comparison_text(compared({options_.traces[1]})), text) << "by its file";
    EXPECT_NE(text.find("learned*"), std::string::npos);

    EXPECT_THROW((void)compared({"p2"}), app::BadInput) << "neither a person nor a file";
    EXPECT_THROW((void)compared({folder + "/p1", folder + "/p2"}), app::BadInput) << "nothing is left";
    fs::copy_file(file("p1_strokes.csv"), file("copy.csv"));
    EXPECT_THROW((void)compared({file("copy.csv")}), app::BadInput) << "scored on what it is trained on";
}

TEST_F(Comparisons, ARecordingIsComparedOnceByWhateverName) {
    EXPECT_NE(app::compare(options_).tuned_on.find("the other 1 recording,"), std::string::npos);
    const std::string first = options_.traces[0], copy = file("copy.csv");
    fs::copy_file(first, copy);
    for (const std::string& again : {first, copy}) {
        options_.traces.push_back(again);
        try {
            (void)app::compare(options_);
            ADD_FAILURE() << again;
        } catch (const app::BadInput& refused) {
            EXPECT_TRUE(std::string(refused.what()).starts_with(again + ": error: found")) << refused.what();
        }
        options_.traces.pop_back();
    }
}

TEST_F(Advances, AreStatedInEveryProduct) {
    const app::Comparison comparison = app::compare(options_);
    const auto json = nlohmann::json::parse(app::format_comparison_json(comparison));
    for (std::size_t i = 0; i < comparison.rows.size(); ++i) {
        const auto& hits = json["results"][i]["hits"];
        EXPECT_EQ(hits["advance_ms"], 1e3 * comparison.rows[i].advance_s.value_or(0));
        EXPECT_EQ(comparison.rows[i].advance_s.has_value(), comparison.rows[i].predictor == "auto");
        for (const char* key : {"true", "predicted", "matched", "precision", "recall", "f1", "median_ms",
                                "p95_ms", "false_per_min", "false_per_min_without_cancel"})
            EXPECT_TRUE(hits.contains(key)) << key;
        EXPECT_EQ(hits["true"], 2 * (5 + static_cast<int>(i * 3 / comparison.rows.size())));
    }
    std::istringstream csv(app::result_table(comparison).csv());
    std::string line, header;
    std::getline(csv, header);
    EXPECT_TRUE(header.ends_with(",advance_ms"));
    while (std::getline(csv, line)) EXPECT_EQ(columns_after_first(line), columns_after_first(header)) << line;
    const app::Table strikes = app::strike_table(comparison, options_.leads_s[0]);
    EXPECT_NE(app::format_comparison_text(comparison).find(strikes.text()), std::string::npos);
    EXPECT_NE(strikes.text().find("advance low ms"), std::string::npos);
    for (const auto& row : strikes.rows)
        EXPECT_EQ(row.back().none(), row.front().plain() != "auto") << row.front().plain();
    for (const auto& row : json["summary"])
        EXPECT_EQ(row["hits"].contains("advance_low_ms"), row["predictor"] == "auto") << row["predictor"];
    EXPECT_NE(app::winners(comparison)[0].find("true strikes"), std::string::npos);
}

TEST_F(Advances, WhereThereIsNothingToStrikeF1PrecisionAndRecallAreNone) {
    options_.predictors = {"cv"};
    options_.tuning = false;
    options_.surface.height_m = -10;  // below every tip
    const app::Comparison comparison = app::compare(options_);
    const auto json = nlohmann::json::parse(app::format_comparison_json(comparison));
    for (const auto& row : json["results"]) {
        EXPECT_EQ(row["hits"]["true"], 0);
        EXPECT_EQ(row["hits"]["predicted"], 0);
        for (const char* key : {"precision", "recall", "f1", "median_ms", "p95_ms"})
            EXPECT_TRUE(row["hits"][key].is_null()) << key;
    }
    EXPECT_NE(app::result_table(comparison).csv().find(",0,0,0,,,,,,,,,,0,0,0\n"), std::string::npos);
    const app::Table strikes = app::strike_table(comparison, options_.leads_s[0]);
    const auto f1 = std::ranges::find(strikes.columns, "hits/f1", &app::Column::name);
    for (const auto& row : strikes.rows)
        EXPECT_EQ(row[static_cast<std::size_t>(f1 - strikes.columns.begin())].shown(".3f", "-"), "-");
}

TEST_F(Advances, NothingIsLearnedFromOneRecording) {
    options_.traces.resize(1);
    EXPECT_EQ(learned(), std::vector<double>{1});
}

TEST_F(Advances, TheExampleOfAnExternalPredictorStrikesAsDifferenceDoes) {
    if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "needs python3";
    options_.predictors = {"difference",
                           "exec:python3 '" MUSICWORLD_SOURCE_DIR "/assets/predictors/difference.py'"};
    options_.traces.resize(1);
    options_.leads_s = {1.0 / 30, 1.0 / 15};
    std::vector<std::vector<double>> errors_ms;
    for (const app::ComparisonRow& row : app::compare(options_).rows)
        if (row.predictor == options_.predictors[0] || row.predictor == options_.predictors[1]) {
            ASSERT_GT(row.hits->matched, 5) << row.predictor;
            errors_ms.push_back(row.hits->errors_ms);
        }
    ASSERT_EQ(errors_ms.size(), 4U);  // by predictor, then lead
    EXPECT_EQ(errors_ms[0], errors_ms[2]);
    EXPECT_EQ(errors_ms[1], errors_ms[3]);
}

TEST_F(Comparisons, TheGridsOfAMapNameTheBestEstimatorOfEverySensor) {
    app::Comparison comparison;
    comparison.options.leads_s = {0.1};
    const auto cell = [](double rate_hz, double noise_mm, const char* name, double rms_mm, double low,
                         double high) {
        app::MapCell made{rate_hz, noise_mm, 3, 0.1, {}};
        made.result.predictor = name;
        made.result.lead_s = 0.1;
        made.result.rms_mm = rms_mm;
        made.result.by_recording.n = 5;
        made.result.by_recording.ratio = 0.5 * (low + high);
        made.result.by_recording.low = low;
        made.result.by_recording.high = high;
        return made;
    };
    comparison.map = {cell(60, 1, "cv*", 8, 0.85, 0.95), cell(60, 1, "ca*", 9, 0.98, 1.01),
                      cell(60, 4, "ca*", 12, 0.96, 1.02)};
    const std::string grids = app::map_grids(comparison);
    EXPECT_NE(grids.find("60 Hz, jitter 3 ms, 10 % lost"), std::string::npos);
    EXPECT_NE(grids.find("<td class=gain>cv* <b>10.0 %</b> (5.0 to 15.0)"), std::string::npos) << grids;
    EXPECT_NE(grids.find("<td class=none>no measurable gain (-2.0 to 4.0)"), std::string::npos) << grids;
    EXPECT_EQ(
        app::map_sentence(comparison, 0.1),
        "100.0 ms ahead the best estimator gains measurably over the best baseline in 1 of 2 sensors, 10.0 % "
        "in the median of these (cv* 1).");
    EXPECT_EQ(app::map_grids({}), "");
    comparison.rows.emplace_back().predictor = "cv*";
    const app::Table csv = app::csv_table(comparison);
    ASSERT_EQ(csv.rows.size(), 1 + 3u) << "every cell, not the best ones alone";
    const auto value = [&](std::size_t row, const std::string& column) {
        const auto found = std::ranges::find(csv.columns, column, &app::Column::name);
        return csv.rows[row].at(static_cast<std::size_t>(found - csv.columns.begin())).plain();
    };
    EXPECT_EQ(value(0, "jitter_ms"), "");
    EXPECT_EQ(value(2, "trace"), "");
    EXPECT_EQ(value(2, "predictor"), "ca*");
    EXPECT_EQ(value(2, "rate_hz"), "60");
    EXPECT_EQ(value(2, "rms_mm"), "9");
    EXPECT_EQ(value(2, "jitter_ms"), "3");
    EXPECT_EQ(value(2, "by_recording/low"), "0.98");
}

}  // namespace
