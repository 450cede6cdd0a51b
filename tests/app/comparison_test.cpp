#include "comparison.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bad_input.h"
#include "comparison_tables.h"
#include "sample_recordings.h"

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
        EXPECT_TRUE(paired.by_person.has_value());
        EXPECT_NEAR(paired.by_recording.ratio, paired.rms_mm / paired.baseline_rms_mm, 1e-12);
        for (const app::ComparisonSummary& summary : comparison.summaries) {
            const bool comparable =
                summary.baseline && summary.lead_s == paired.lead_s && !summary.predictor.ends_with("*");
            EXPECT_TRUE(!comparable || paired.baseline_rms_mm <= summary.error.rms_mm * (1 + 1e-12))
                << summary.predictor;
        }
    }
    EXPECT_EQ(comparison.paired.size(), 2 * 4U);  // cv, thesis, cv*, cv** at two leads
    const auto least =
        std::min_element(comparison.summaries.begin(), comparison.summaries.end(),
                         [](const auto& a, const auto& b) { return a.error.rms_mm < b.error.rms_mm; });
    EXPECT_NE(app::winners(comparison)[0].find(least->predictor + " errs least"), std::string::npos);
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
    std::istringstream csv(app::format_comparison_csv(comparison));
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
    EXPECT_NEAR(row_of("mine").error.rms_mm, row_of("hold").error.rms_mm, 1e-9);
    EXPECT_TRUE(row_of("mine").external);
    EXPECT_EQ(std::count_if(comparison.rows.begin(), comparison.rows.end(),
                            [](const app::ComparisonRow& row) { return row.predictor == "mine"; }),
              1);
    options_.leads_s = {1.0 / 30};
    EXPECT_THROW((void)app::compare(options_), app::BadInput);  // the file's lead is not asked for
}

}  // namespace
