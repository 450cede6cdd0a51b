#include "play/play_run.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <stdexcept>

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

/// Records of RFC 4180, written from the standard: quoted fields may hold commas, line breaks and doubled
/// quotes.
std::vector<std::vector<std::string>> read_csv(const std::string& text) {
    std::vector<std::vector<std::string>> records(1, {""});
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        std::string& field = records.back().back();
        if (quoted && text[i] == '"' && text[i + 1] == '"') {
            field += text[++i];
        } else if (text[i] == '"') {
            quoted = !quoted;
        } else if (!quoted && text[i] == ',') {
            records.back().emplace_back();
        } else if (!quoted && text[i] == '\n') {
            records.push_back({""});
        } else {
            field += text[i];
        }
    }
    EXPECT_EQ(records.back(), std::vector<std::string>{""}) << "the last line ends";
    records.pop_back();
    return records;
}

void expect_same_bits(const std::string& text, double value) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(std::strtod(text.c_str(), nullptr)),
              std::bit_cast<std::uint64_t>(value))
        << text;
}

const std::vector<double> kAwkward = {
    0.1 + 0.2, 1.0 / 3, -0.0, 1e7 + 1e-9, 5e-324, -1.7976931348623157e308, 123456789.123456789};

TEST(EventsTable, HasItsColumnsAndARowAStrikeThatReadsBackToTheSameValues) {
    app::PlayResult result = sample_play_result();
    result.instruments[2] = "two\nlines";
    for (std::size_t i = 0; i < kAwkward.size(); ++i) {
        app::Strike& s = result.strikes[i % result.strikes.size()];
        (i % 2 == 0 ? s.onset_s : s.point_world.y()) = kAwkward[i];
    }
    const std::string text = app::format_events(result);
    EXPECT_TRUE(
        text.starts_with("id,stick,instrument,onset_s,speed_mps,px,py,pz,scheduled_at_s,outcome,moves,"
                         "decided_at_s,model\n"));
    const auto records = read_csv(text);
    ASSERT_EQ(records.size(), 1 + result.strikes.size());
    for (std::size_t i = 0; i < result.strikes.size(); ++i) {
        const app::Strike& s = result.strikes[i];
        const std::vector<std::string>& row = records[i + 1];
        ASSERT_EQ(row.size(), 13U);
        EXPECT_EQ(row[0], std::to_string(s.id));
        EXPECT_EQ(row[1], result.sticks[s.stick]);
        EXPECT_EQ(row[2], result.instruments[s.instrument]);
        expect_same_bits(row[3], s.onset_s);
        expect_same_bits(row[4], s.speed_mps);
        for (int axis = 0; axis < 3; ++axis)
            expect_same_bits(row[5 + static_cast<std::size_t>(axis)], s.point_world[axis]);
        expect_same_bits(row[8], s.scheduled_at_s);
        EXPECT_EQ(row[9], s.outcome == app::Outcome::released ? "released" : "cancelled");
        EXPECT_EQ(row[10], std::to_string(s.moves));
        expect_same_bits(row[11], s.decided_at_s);
        EXPECT_EQ(row[12], result.options.sound_predictor);
    }
}

TEST(EventsTable, AStrikeThatWasNeverDecidedIsAMistakeOfTheProgram) {
    app::PlayResult result = sample_play_result();
    result.strikes[1].outcome = app::Outcome::pending;
    EXPECT_THROW((void)app::format_events(result), std::logic_error);
}

TEST(ContactsTable, HasItsColumnsAndARowAContactThatReadsBackToTheSameValues) {
    app::PlayResult result = sample_play_result();
    result.contacts[0].t_s = 0.1 + 0.2;
    const std::string text = app::format_contacts(result);
    EXPECT_TRUE(text.starts_with("t,stick,instrument,speed_mps,px,py,pz,matched_id\n"));
    const auto records = read_csv(text);
    ASSERT_EQ(records.size(), 1 + result.contacts.size());
    for (std::size_t i = 0; i < result.contacts.size(); ++i) {
        const app::TrueContact& c = result.contacts[i];
        const std::vector<std::string>& row = records[i + 1];
        ASSERT_EQ(row.size(), 8U);
        expect_same_bits(row[0], c.t_s);
        EXPECT_EQ(row[1], result.sticks[c.stick]);
        EXPECT_EQ(row[2], result.instruments[c.instrument]);
        expect_same_bits(row[3], c.speed_mps);
        for (int axis = 0; axis < 3; ++axis)
            expect_same_bits(row[4 + static_cast<std::size_t>(axis)], c.point_world[axis]);
        EXPECT_EQ(row[7], std::to_string(c.matched_id));
    }
}

TEST(Tables, OfARunWithoutStrikesAreTheirHeaders) {
    const app::PlayResult nothing;
    EXPECT_EQ(read_csv(app::format_events(nothing)).size(), 1U);
    EXPECT_EQ(read_csv(app::format_contacts(nothing)).size(), 1U);
}

}  // namespace
