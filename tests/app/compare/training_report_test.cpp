#include "compare/training_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "files/bad_input.h"
#include "files/checksum.h"
#include "sample_recordings.h"
#include "temporary_folder.h"

namespace {

std::vector<app::Recording> recordings(std::size_t count) {
    std::vector<app::Recording> all;
    for (std::size_t i = 0; i < count; ++i)
        all.push_back(sample::recording_of(sample::steady, 4, 100, "take" + std::to_string(i) + ".csv"));
    return all;
}

TEST(TrainingField, HoldsOutEveryFifthOfFiveRecordingsOrMore) {
    const std::vector<app::Recording> eleven = recordings(11);
    const app::TrainingField field = app::training_field(eleven);
    ASSERT_EQ(field.sticks.size(), 11U);
    for (std::size_t i = 0; i < 11; ++i) {
        EXPECT_EQ(field.sticks[i].held_out, i == 4 || i == 9) << i;
        EXPECT_EQ(field.sticks[i].recording, i);
        EXPECT_EQ(field.sticks[i].stick.samples.size(), eleven[i].trace.sticks[0].samples.size());
    }
}

TEST(TrainingField, HoldsOutTheEndOfEachOfFewerRecordings) {
    const app::TrainingField field = app::training_field(recordings(2));
    ASSERT_EQ(field.sticks.size(), 4U);
    for (const std::size_t i : {0, 2}) {
        const auto& learned = field.sticks[i];
        const auto& end = field.sticks[i + 1];
        EXPECT_FALSE(learned.held_out);
        EXPECT_TRUE(end.held_out);
        EXPECT_EQ(learned.stick.samples.size() + end.stick.samples.size(), 401U);
        EXPECT_NEAR(static_cast<double>(end.stick.samples.size()), 80, 1);
        EXPECT_GT(end.stick.samples.front().t_s, learned.stick.samples.back().t_s);
    }
    std::vector<app::Recording> brief = {sample::recording_of(sample::steady, 0.1, 100)};
    EXPECT_THROW((void)app::training_field(brief), app::BadInput);
}

TEST(TrainingField, PassesOnTheShaftAndWhatIsFlagged) {
    std::vector<app::Recording> all = recordings(5);
    all[1].geometry.shaft = Eigen::Vector3d::UnitY();
    all[1].marks[0].flagged_s = {1.5};
    all[1].marks[0].flagged_rotations_s = {2.5};
    const app::TrainingField field = app::training_field(all);
    EXPECT_EQ(field.sticks[1].shaft, Eigen::Vector3d::UnitY());
    EXPECT_EQ(field.sticks[1].flagged_s, std::vector{1.5});
    EXPECT_EQ(field.sticks[1].flagged_rotations_s, std::vector{2.5});
    EXPECT_EQ(field.sticks[0].shaft, -Eigen::Vector3d::UnitZ());
}

TEST(Provenance, SaysWhatAModelWasMadeOfAndWhetherThatWasSynthetic) {
    const TemporaryFolder folder;
    std::vector<app::Recording> all = recordings(2);
    for (app::Recording& recording : all) {
        recording.trace.file = folder.write(recording.trace.file, "content");
        recording.trace.source = "synthetic: a test";
    }
    tracking::TrainingResult result;
    result.scores.push_back({1.0 / 30, 8, 10, 20, 0.5, 0.95});
    const auto lines_of = [&] {
        const app::TrainingField field = app::training_field(all);
        tracking::TrainingOptions options;
        options.seed = 7;
        return app::provenance_of(all, field, options, result, "1.2.3");
    };
    const auto lines = lines_of();
    const auto value_of = [&](const std::string& key) {
        return std::ranges::find(lines, key, [](const auto& line) { return line.first; })->second;
    };
    EXPECT_EQ(value_of("trained_on"), "synthetic traces alone");
    EXPECT_EQ(value_of("made_by"), "musicworld 1.2.3");
    EXPECT_NE(value_of("command").find("take1.csv --hidden 64 --steps 20000 --seed 7"), std::string::npos);
    // SHA-256 of "content".
    EXPECT_TRUE(
        value_of("input").starts_with("ed7002b439e9ac845f22357d822bac1444730fbdb6016d3ec9432297b9ec9f73 "));
    EXPECT_TRUE(value_of("error").starts_with("0.0333 s ahead: 8.0 mm RMS with the shaft, 10.0 without"));
    EXPECT_EQ(std::ranges::count(lines, "contact_times", [](const auto& line) { return line.first; }), 0)
        << "nothing was learned of contacts";
    all[1].trace.source = "a person";
    EXPECT_EQ(lines_of().front().second, "recordings");
}

TEST(BundledModel, IsOfTheBundledSyntheticTracesAsTheyAre) {
    const std::filesystem::path top = MUSICWORLD_SOURCE_DIR;
    const tracking::PathModel model = tracking::read_path_model(top / "assets/models/general.model");
    ASSERT_FALSE(model.provenance.empty());
    EXPECT_EQ(model.provenance.front(),
              std::pair(std::string("trained_on"), std::string("synthetic traces alone")));
    int inputs = 0;
    for (const auto& [key, value] : model.provenance) {
        if (key != "input") continue;
        ++inputs;
        const std::size_t blank = value.find(' ');
        const std::string file = value.substr(blank + 1);
        EXPECT_TRUE(file.starts_with("assets/traces/")) << file;
        EXPECT_EQ(app::sha256_of_file(top / file), value.substr(0, blank)) << "train it again: " << file;
    }
    EXPECT_EQ(inputs, 3);
}

}  // namespace
