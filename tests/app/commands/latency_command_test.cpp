#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "commands/play_command.h"
#include "files/bad_input.h"
#include "latency/latency_comparison.h"
#include "sample_realtime.h"
#include "temporary_folder.h"

namespace app {
namespace {

using Json = nlohmann::json;

/// A document as `latency` writes it, of one stage and a few figures.
std::string document(double p50_ms, int missed, const char* stage = "query") {
    return Json({{"stages",
                  {{{"name", stage}, {"p50_ms", p50_ms}, {"p95_ms", 2 * p50_ms}, {"p99_ms", 3 * p50_ms}}}},
                 {"frames", {{"total", 100}, {"missed", missed}}},
                 {"sound_minus_picture_ms", {{"median", nullptr}}}})
        .dump();
}

std::filesystem::path run_folder(const TemporaryFolder& folder, const char* name, const std::string& text) {
    std::filesystem::create_directory(folder.path() / name);
    folder.write(std::string(name) + "/latency.json", text);
    return folder.path() / name;
}

TEST(LatencyComparison, PutsStagesSideBySideWithRatios) {
    const TemporaryFolder folder;
    const LatencyComparison c =
        compare_latency(run_folder(folder, "a", document(2, 0)), run_folder(folder, "b", document(3, 4)));
    ASSERT_EQ(c.stages.rows.size(), 1U);
    const Json json = Json::parse(format_json(c));
    EXPECT_EQ(json["stages"][0]["b"]["p99_ms"], 9);
    EXPECT_TRUE(json["stages"][0]["a"]["max_ms"].is_null()) << "no maximum in the documents";
    EXPECT_EQ(json["stages"][0]["ratio"]["p50_ms"], 1.5);
    EXPECT_TRUE(json["figures"][1]["ratio"].is_null()) << "4 missed frames over none";
    EXPECT_NE(format_text(c).find("query"), std::string::npos);
    EXPECT_TRUE(format_page(c).ends_with("</html>\n"));
}

TEST(LatencyComparison, KeepsStagesThatOneRunAloneHas) {
    const TemporaryFolder folder;
    const LatencyComparison c = compare_latency(run_folder(folder, "a", document(2, 0, "one")),
                                                run_folder(folder, "b", document(2, 0, "other")));
    ASSERT_EQ(c.stages.rows.size(), 2U);
    const Json json = Json::parse(format_json(c));
    EXPECT_TRUE(json["stages"][0]["b"].is_null());
    EXPECT_TRUE(json["stages"][1]["a"].is_null());
    EXPECT_TRUE(json["stages"][1]["ratio"].is_null());
}

TEST(LatencyComparison, RefusesWhatLatencyDidNotWrite) {
    const TemporaryFolder folder;
    const auto good = run_folder(folder, "good", document(1, 0));
    const std::string bad[] = {"", "{", "[]", "{\"stages\": 3}", "{\"stages\": [{\"p50_ms\": 1}]}"};
    for (const std::string& text : bad) {
        const auto wrong = run_folder(folder, "bad", text);
        try {
            (void)compare_latency(good, wrong);
            ADD_FAILURE() << text;
        } catch (const BadInput& error) {
            EXPECT_NE(std::string(error.what()).find("latency.json: error: found"), std::string::npos)
                << error.what();
        }
        std::filesystem::remove_all(wrong);
    }
    EXPECT_THROW((void)compare_latency(good, folder.path() / "none"), BadInput);
}

/// The program with `latency` alone, over a made-up run; what was asked of it.
int run_program(std::vector<std::string> arguments, RealtimeOptions* asked = nullptr) {
    CLI::App tree("test");
    Command program(tree);
    add_latency_command(program, [asked](const RealtimeOptions& options) {
        if (asked != nullptr) *asked = options;
        EXPECT_FALSE(options.play.out.empty());
        RealtimeOutcome run;
        const Kit kit = sample::one_drum();
        run.play.sticks = {"left"};
        run.play.instruments = {"snare"};
        sample::draw(run.realtime, sample::falling(0.493, sample::touch_height(kit), 2), 0.4, 0.6);
        sample::sound(run.play, run.realtime, {0.5});
        run.latency = latency_report(run.play, run.realtime, kit, sample::kTipRadius);
        return run;
    });
    std::reverse(arguments.begin(), arguments.end());
    try {
        tree.parse(arguments);
    } catch (const CLI::ParseError& wrong) {
        return wrong.get_exit_code();
    }
    return 0;
}

std::string printed_by(const std::vector<std::string>& arguments, RealtimeOptions* asked = nullptr) {
    testing::internal::CaptureStdout();
    EXPECT_EQ(run_program(arguments, asked), 0);
    return testing::internal::GetCapturedStdout();
}

TEST(LatencyCommand, RunsInATemporaryFolderUnlessOneIsNamed) {
    RealtimeOptions asked;
    const Json json = Json::parse(printed_by({"latency", "roll", "--seconds", "5/2", "--json"}, &asked));
    EXPECT_NEAR(json["sound_minus_picture_ms"]["median"].get<double>(), 7, 1e-5);
    EXPECT_EQ(asked.play.trace.filename(), "roll.csv");
    EXPECT_EQ(asked.seconds, 2.5);
    EXPECT_FALSE(std::filesystem::exists(asked.play.out)) << asked.play.out;
    EXPECT_NE(printed_by({"latency", "roll", "--out", "some/where"}, &asked).find("latency.html"),
              std::string::npos);
    EXPECT_EQ(asked.play.out, "some/where");
}

TEST(LatencyCommand, ComparesTwoFolders) {
    const TemporaryFolder folder;
    const auto a = run_folder(folder, "a", document(2, 1)), b = run_folder(folder, "b", document(3, 4));
    const Json json =
        Json::parse(printed_by({"latency", "--compare", a, b, "--json", "--out", folder.path() / "c"}));
    EXPECT_EQ(json["figures"][1]["ratio"], 4);
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "c" / "comparison.json"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "c" / "report.html"));
}

TEST(LatencyCommand, RefusesValuesThatCannotBe) {
    EXPECT_THROW((void)run_program({"latency", "--seconds", "long"}), BadInput);
    EXPECT_THROW((void)run_program({"latency", "--seconds", "-1"}), BadInput);
    EXPECT_THROW((void)run_program({"latency", "--output-lead", "0"}), BadInput);
    EXPECT_THROW((void)run_program({"latency", "--fps", "0"}), BadInput);
    EXPECT_THROW((void)run_program({"latency", "--lead", "some"}), BadInput);
    EXPECT_THROW((void)run_program({"latency", "--compare", "one"}), BadInput);
}

}  // namespace
}  // namespace app
