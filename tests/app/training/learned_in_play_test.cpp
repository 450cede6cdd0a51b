#include "sticks/learned_in_play.h"

#include <gtest/gtest.h>

#include <cmath>

#include "files/bad_input.h"
#include "sticks/predictors.h"
#include "temporary_folder.h"

namespace {

using tracking::Experience;

/// What 10 s of strokes teach `auto`.
Experience ten_seconds() {
    const auto predictor = app::make_any_predictor(app::picture_specification("auto"), {});
    for (int i = 0; i < 600; ++i) {
        const double t = i / 60.0;
        (void)predictor->correct({t, {0.1 * std::sin(5 * t), 0.4 * std::abs(std::sin(8 * t)), 0.2}});
    }
    return tracking::experience_of(*predictor).value();
}

TEST(LearnedInPlay, IsAModelThatSaysWhereItComesFrom) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "mine.model";
    const std::vector<Experience> experiences = {ten_seconds(), ten_seconds()};
    app::save_learned({file, "play", app::picture_specification("auto"), "osc:9000"}, experiences);
    const tracking::PathModel model = tracking::read_path_model(file),
                              base = tracking::read_path_model(*app::model_file("learned"));
    EXPECT_NE(model.layers[2].weights, base.layers[2].weights);
    EXPECT_EQ(model.layers[1].weights, base.layers[1].weights);
    std::string keys;
    for (const auto& [key, value] : model.provenance) keys += key + " ";
    EXPECT_TRUE(keys.starts_with("trained_on made_by command begun_with base_trained_on")) << keys;
    // Learning goes on from it, and the head does not grow by what was behind.
    app::save_learned({folder.path() / "next.model", "play", "arbitrated:model=" + file.string(), "osc:9000"},
                      experiences);
    EXPECT_EQ(tracking::read_path_model(folder.path() / "next.model").provenance.size(), 8u);
}

TEST(LearnedInPlay, CrossesBetweenProcessesToTheBit) {
    const std::vector<Experience> experiences = {ten_seconds(), ten_seconds()};
    const std::string bytes = app::bytes_of(experiences);
    const std::vector<Experience> back = app::experiences_of(bytes);
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[1].moments, experiences[1].moments);
    EXPECT_EQ(back[1].against, experiences[1].against);
    EXPECT_TRUE(app::experiences_of("").empty());
    EXPECT_THROW((void)app::experiences_of(bytes.substr(0, bytes.size() - 1)), std::runtime_error);
    EXPECT_THROW((void)app::experiences_of(std::string(16, '\xff')), std::runtime_error);
}

TEST(LearnedInPlay, IsRefusedOfPredictorsThatLearnNothing) {
    const TemporaryFolder folder;
    for (const char* learns : {"auto", "online", "arbitrated", "auto:model=general"})
        EXPECT_NO_THROW(app::check_learns(learns, folder.path() / "m")) << learns;
    for (const char* not_so : {"thesis", "learned", "arbitrated:memory=0", "exec:cat"})
        EXPECT_THROW(app::check_learns(not_so, folder.path() / "m"), app::BadInput) << not_so;
    EXPECT_THROW(app::check_learns("auto", folder.path() / "none" / "m"), app::BadInput);
}

}  // namespace
