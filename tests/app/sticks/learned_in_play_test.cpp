#include "sticks/learned_in_play.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "files/bad_input.h"
#include "sticks/predictors.h"
#include "temporary_folder.h"

namespace {

using tracking::Experience;

/// What 10 s of strokes teach `auto`.
Experience ten_seconds(const std::string& stick = "left") {
    const auto predictor = app::make_any_predictor(app::picture_specification("auto"), {});
    for (int i = 0; i < 600; ++i) {
        const double t = i / 60.0;
        (void)predictor->correct({t, {0.1 * std::sin(5 * t), 0.4 * std::abs(std::sin(8 * t)), 0.2}});
    }
    return tracking::experience_of(*predictor, stick).value();
}

TEST(LearnedInPlay, IsAModelThatSaysWhereItComesFrom) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "mine.model";
    const std::vector<Experience> experiences = {ten_seconds("left"), ten_seconds("right")};
    app::LearnedModel({file, "play", app::picture_specification("auto"), "osc:9000"}).save(experiences);
    const tracking::PathModel model = tracking::read_path_model(file),
                              base = tracking::read_path_model(*app::model_file("learned"));
    EXPECT_NE(model.layers[2].weights, base.layers[2].weights);
    EXPECT_EQ(model.layers[1].weights, base.layers[1].weights);
    std::string keys;
    for (const auto& [key, value] : model.provenance) keys += key + " ";
    EXPECT_TRUE(keys.starts_with("trained_on made_by command begun_with base_trained_on")) << keys;
    // Learning goes on from it, and the head does not grow by what was behind.
    app::LearnedModel({folder.path() / "next.model", "play", "arbitrated:model=" + file.string(), "osc:9000"})
        .save(experiences);
    EXPECT_EQ(tracking::read_path_model(folder.path() / "next.model").provenance.size(), 8u);
}

TEST(LearnedInPlay, TheNextPerformanceBeginsWithTheTrustThatTheLastOneEndedWith) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "mine.model";
    const std::vector<Experience> experiences = {ten_seconds("left"), ten_seconds("right")};
    app::LearnedModel({file, "play", app::picture_specification("auto"), "osc:9000"}).save(experiences);
    const auto trust_of = [&](const char* stick) {
        const auto predictor =
            app::make_any_predictor("arbitrated:model=" + file.string(), {}, {.name = stick});
        return tracking::experience_of(*predictor, stick).value().trust.value();
    };
    const auto equal = [](const tracking::Trust& a, const tracking::Trust& b) {
        return a.stick == b.stick && std::memcmp(&a.leads, &b.leads, sizeof a.leads) == 0;
    };
    EXPECT_TRUE(equal(trust_of("left"), *experiences[0].trust));
    EXPECT_TRUE(equal(trust_of("right"), *experiences[1].trust));
    EXPECT_GT(trust_of("left").leads[0].position.known_s, 5);
    EXPECT_EQ(trust_of("third").leads[0].position.known_s, 0) << "a stick that was not there";
}

TEST(LearnedInPlay, CrossesBetweenProcessesToTheBit) {
    const std::vector<Experience> experiences = {ten_seconds("left"), ten_seconds("right")};
    const std::string bytes = app::bytes_of(experiences);
    const std::vector<Experience> back = app::experiences_of(bytes);
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[1].moments, experiences[1].moments);
    EXPECT_EQ(back[1].against, experiences[1].against);
    ASSERT_TRUE(back[1].trust && experiences[1].trust);
    EXPECT_EQ(back[1].trust->stick, "right");
    EXPECT_EQ(std::memcmp(&back[1].trust->leads, &experiences[1].trust->leads, sizeof back[1].trust->leads),
              0);
    EXPECT_TRUE(app::experiences_of("").empty());
    for (const std::size_t less : {1UL, 641UL, 646UL})  // in the numbers, the name, its length
        EXPECT_THROW((void)app::experiences_of(bytes.substr(0, bytes.size() - less)), std::runtime_error);
    EXPECT_THROW((void)app::experiences_of(std::string(16, '\xff')), std::runtime_error);
}

TEST(LearnedInPlay, IsRefusedBeforeAnythingIsPlayed) {
    const TemporaryFolder folder;
    const auto begin = [&](const std::string& predictor, const std::string& file, const std::string& input) {
        const app::LearnedModel model(
            {folder.path() / file, "play", app::picture_specification(predictor), input});
    };
    for (const char* learns : {"auto", "online", "arbitrated", "auto:model=general"})
        EXPECT_NO_THROW(begin(learns, "m", "osc:9000")) << learns;
    for (const char* not_so : {"thesis", "learned", "arbitrated:memory=0", "exec:cat"})
        EXPECT_THROW(begin(not_so, "m", "osc:9000"), app::BadInput) << not_so;
    EXPECT_THROW(begin("auto", "none/m", "osc:9000"), app::BadInput);
    // A model's head has no place for such names.
    EXPECT_THROW(begin("auto", "m", "two\nlines.csv"), app::BadInput);
    EXPECT_THROW(begin("auto", "two\nlines", "osc:9000"), app::BadInput);
}

TEST(LearnedInPlay, IsNotSavedOnAnotherModelThanThatOfTheBeginning) {
    const TemporaryFolder folder;
    const std::filesystem::path base = folder.path() / "base.model", file = folder.path() / "m";
    std::filesystem::copy(*app::model_file("learned"), base);
    const app::LearnedModel model({file, "play", "arbitrated:model=" + base.string(), "osc:9000"});
    folder.write("base.model", tracking::format_path_model(tracking::taught(tracking::read_path_model(base),
                                                                            std::vector{ten_seconds()})));
    std::vector<std::string> failures;
    model.save_or_say(std::vector{ten_seconds()}, {}, failures);
    ASSERT_EQ(failures.size(), 1u);
    EXPECT_NE(failures[0].find("base.model than when the run began"), std::string::npos) << failures[0];
    EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(LearnedInPlay, IsSavedWithoutTheSticksThatSaidNothing) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "m";
    const app::LearnedModel model({file, "play", app::picture_specification("auto"), "osc:9000"});
    std::vector<std::string> failures;
    model.save_or_say({}, {"left", "right"}, failures);
    EXPECT_EQ(failures.size(), 2u);
    EXPECT_FALSE(std::filesystem::exists(file));
    failures.clear();
    model.save_or_say(std::vector{ten_seconds()}, {"right"}, failures);
    ASSERT_EQ(failures.size(), 1u);
    EXPECT_NE(failures[0].find("stick right"), std::string::npos) << failures[0];
    EXPECT_TRUE(std::filesystem::exists(file));
}

}  // namespace
