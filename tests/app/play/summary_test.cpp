#include "play/summary.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sample_play_result.h"

namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> keys_of(const Json& object) {
    std::vector<std::string> keys;
    for (const auto& item : object.items()) keys.push_back(item.key());
    return keys;
}

TEST(Summary, TheContractsKeysComeFirstAndInOrder) {
    const Json summary = Json::parse(app::format_summary(sample_play_result()));
    const std::vector<std::string> contract = {"trace",
                                               "kit",
                                               "duration_s",
                                               "frames",
                                               "picture_predictor",
                                               "sound_predictor",
                                               "render_lead_s",
                                               "sound_lead_s",
                                               "release_margin_s",
                                               "strikes",
                                               "timing_ms",
                                               "realtime_factor",
                                               "stages_s",
                                               "workers",
                                               "inputs",
                                               "fingerprint",
                                               "versions"};
    std::vector<std::string> keys = keys_of(summary);
    ASSERT_GE(keys.size(), contract.size());
    keys.resize(contract.size());
    EXPECT_EQ(keys, contract);
    std::vector<std::string> strikes = keys_of(summary["strikes"]);
    strikes.resize(6);
    EXPECT_EQ(strikes,
              (std::vector<std::string>{"true", "released", "cancelled", "moved", "false", "missed"}));
    EXPECT_EQ(keys_of(summary["timing_ms"]), (std::vector<std::string>{"median", "p95"}));
    EXPECT_EQ(keys_of(summary["workers"]), (std::vector<std::string>{"count", "lost", "bodies_reowned"}));
    EXPECT_EQ(keys_of(summary["inputs"][0]), (std::vector<std::string>{"file", "sha256"}));
}

TEST(Summary, HoldsTheResultsValuesToTheBit) {
    const app::PlayResult result = sample_play_result();
    const Json summary = Json::parse(app::format_summary(result));
    EXPECT_EQ(summary["trace"], result.trace);
    EXPECT_EQ(summary["duration_s"].get<double>(), result.t_end_s - result.t0_s);
    EXPECT_EQ(summary["frames"], 30);
    EXPECT_EQ(summary["render_lead_s"].get<double>(), 1.0 / 30);
    EXPECT_EQ(summary["sound_lead_s"].get<double>(), 1.0 / 15);
    EXPECT_EQ(summary["strikes"]["true"], 3);
    EXPECT_EQ(summary["strikes"]["released"], 3);
    EXPECT_EQ(summary["strikes"]["cancelled"], 1);
    EXPECT_EQ(summary["strikes"]["moved"], 2);
    EXPECT_EQ(summary["strikes"]["false"], 1);
    EXPECT_EQ(summary["strikes"]["missed"], 1);
    EXPECT_EQ(summary["strikes"]["false_turned_late"], 1);
    EXPECT_EQ(summary["timing_ms"]["p95"].get<double>(), 4.0);
    EXPECT_EQ(summary["realtime_factor"].get<double>(), (result.t_end_s - result.t0_s) / 0.5);
    EXPECT_EQ(summary["stages_s"]["drawing"].get<double>(), 0.3);
    EXPECT_EQ(summary["inputs"][1]["sha256"], std::string(64, 'b'));
    EXPECT_EQ(summary["versions"]["csound"], "6.18");
}

TEST(Summary, WithoutAMatchedNoteTimingIsNullNotZero) {
    app::PlayResult result = sample_play_result();
    result.score.false_notes = result.score.released;
    const Json summary = Json::parse(app::format_summary(result));
    EXPECT_TRUE(summary["timing_ms"]["median"].is_null());
    EXPECT_TRUE(summary["timing_ms"]["p95"].is_null());
}

TEST(Summary, AnEmptyResultIsStillAWholeObject) {
    const Json summary = Json::parse(app::format_summary(app::PlayResult{}));
    EXPECT_TRUE(summary["stages_s"].is_object());
    EXPECT_TRUE(summary["versions"].is_object());
    EXPECT_TRUE(summary["inputs"].is_array());
    EXPECT_TRUE(summary["realtime_factor"].is_null());
}

TEST(Summary, AFileNameThatIsNotUtf8IsStillWritten) {
    app::PlayResult result = sample_play_result();
    result.trace = "take\xff.csv";
    EXPECT_EQ(Json::parse(app::format_summary(result))["trace"], "take\xef\xbf\xbd.csv");
}

TEST(Summary, DiffersBetweenTwoRunsOnlyInTheTimings) {
    app::PlayResult slower = sample_play_result();
    slower.wall_s = 7;
    slower.stages_s[0].second = 5;
    Json a = Json::parse(app::format_summary(sample_play_result())),
         b = Json::parse(app::format_summary(slower));
    EXPECT_NE(a, b);
    for (const char* timing : {"realtime_factor", "stages_s", "wall_s"}) a.erase(timing), b.erase(timing);
    EXPECT_EQ(a, b);
}

}  // namespace
