#include "sticks/predictors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "files/bad_input.h"
#include "temporary_folder.h"

namespace {

using Parts = std::vector<std::string>;

TEST(SplitSpecifications, KeepsParametersWithTheirNames) {
    EXPECT_EQ(app::split_specifications("auto"), Parts{"auto"});
    EXPECT_EQ(app::split_specifications("hold,ca:q=1e9,gate=5,cv,naive:n=4"),
              (Parts{"hold", "ca:q=1e9,gate=5", "cv", "naive:n=4"}));
    EXPECT_EQ(app::split_specifications("singer:alpha=3,q=1e10,exec:a --b=1,hold"),
              (Parts{"singer:alpha=3,q=1e10", "exec:a --b=1", "hold"}));
}

TEST(SplitSpecifications, ACommandMayHoldEscapedCommas) {
    EXPECT_EQ(app::split_specifications("exec:python3 a.py 1\\,2\\,3 x:y=z,cv"),
              (Parts{"exec:python3 a.py 1,2,3 x:y=z", "cv"}));
    EXPECT_EQ(app::split_specifications("exec:a,q=3"), (Parts{"exec:a", "q=3"}));
}

TEST(SplitSpecifications, RefusesEmptyParts) {
    for (const char* list : {"", ",", "hold,", ",hold", "hold,,cv"})
        EXPECT_THROW((void)app::split_specifications(list), app::BadInput) << list;
}

TEST(CheckSpecification, TakesEveryKindAndRefusesTheRestInOneLine) {
    for (const char* good : {"auto", "auto:model=general", "learned", "learned:model=general",
                             "arbitrated:decay=4", "cv:q=1e8,gate=5", "exec:does not start here"})
        EXPECT_NO_THROW(app::check_specification(good)) << good;
    for (const char* bad : {"", "oracle", "ca:q=much", "auto:q=1", "auto:model=general,q=1", "learned:q=1",
                            "learned:model=no such model", "exec:", "exec:  ", "exec"}) {
        try {
            app::check_specification(bad);
            ADD_FAILURE() << bad;
        } catch (const app::BadInput& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find("error: "), std::string::npos) << message;
            EXPECT_NE(message.find("found "), std::string::npos) << message;
            EXPECT_NE(message.find("expected "), std::string::npos) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        }
    }
}

TEST(MakeAnyPredictor, MakesThoseOfTracking) {
    const std::vector<double> leads = {0.1};
    EXPECT_NE(app::make_any_predictor("difference", leads), nullptr);
    EXPECT_THROW((void)app::make_any_predictor("auto", leads), app::BadInput) << "to be resolved before";
    EXPECT_TRUE(app::is_external("exec:a"));
    EXPECT_FALSE(app::is_external("cv"));
}

TEST(Predictors, AutoDrawsWithItsModelAndTheFilterOrTheBundledOne) {
    EXPECT_EQ(app::picture_specification("auto"), "arbitrated");
    EXPECT_EQ(app::picture_specification("auto:model=mine.model"), "arbitrated:model=mine.model");
    for (const char* each : {"auto", "auto:model=mine.model"}) {
        EXPECT_EQ(app::sound_specification(each), app::sound_specification("auto"));
        EXPECT_EQ(app::confirming_specification(each), app::confirming_specification("auto"));
        EXPECT_TRUE(app::is_auto(each));
    }
    EXPECT_FALSE(app::is_auto("cv:q=1"));
    EXPECT_EQ(app::picture_specification("learned:model=mine.model"), "learned:model=mine.model");
}

TEST(Predictors, TheFileOfAModelIsTheOneNamedOrTheBundledOne) {
    EXPECT_EQ(app::model_file("cv:q=1"), std::nullopt);
    EXPECT_EQ(app::model_file("learned")->filename(), "general.model");
    EXPECT_EQ(app::model_file("arbitrated:decay=4,model=general,q=1"), app::model_file("learned"));
    EXPECT_THROW((void)app::model_file("learned:model=no such model"), app::BadInput);
}

TEST(Predictors, AModelsFileMayLieInAFolderWithCommas) {
    const TemporaryFolder folder;
    const std::filesystem::path odd = folder.path() / "a,b, c=d";
    std::filesystem::create_directory(odd);
    std::filesystem::copy(*app::model_file("learned"), odd / "mine.model");
    const std::string file = (odd / "mine.model").string();
    for (const std::string& each :
         {"learned:model=" + file, "arbitrated:model=" + file + ",q=1e8", "arbitrated:q=1e8,model=" + file}) {
        EXPECT_EQ(app::model_file(each), odd / "mine.model");
        EXPECT_NO_THROW((void)app::make_any_predictor(each, {})) << each;
    }
    EXPECT_NO_THROW(app::check_specification("auto:model=" + file));
    EXPECT_EQ(app::split_specifications("hold,learned:model=a\\,b,q=1,cv"),
              (Parts{"hold", "learned:model=a,b,q=1", "cv"}));
    setenv("MUSICWORLD_ASSETS", odd.c_str(), 1);
    for (const char* each : {"kits", "models"}) std::filesystem::create_directory(odd / each);
    std::filesystem::copy(odd / "mine.model", odd / "models" / "general.model");
    for (const char* each : {"auto", "learned", "arbitrated:q=1e8"})
        EXPECT_NO_THROW(app::check_specification(each)) << each;
    unsetenv("MUSICWORLD_ASSETS");
}

TEST(Predictors, LearnedFollowsTheShaftThatItIsTold) {
    const std::vector<double> leads = {0.05};
    const auto along_z = app::make_any_predictor("learned", leads, {"left", -Eigen::Vector3d::UnitZ()});
    const auto along_y = app::make_any_predictor("learned", leads, {"left", Eigen::Vector3d::UnitY()});
    const auto named =
        app::make_any_predictor("learned:model=general", leads, {"left", -Eigen::Vector3d::UnitZ()});
    for (int i = 0; i < 30; ++i) {
        tracking::PoseSample sample{i / 60.0, {0, 1 + 0.2 * std::sin(0.2 * i), 0}};
        sample.orientation = Eigen::AngleAxisd(0.5 * std::sin(0.2 * i), Eigen::Vector3d::UnitX());
        sample.has_orientation = true;
        for (tracking::Predictor* each : {along_z.get(), along_y.get(), named.get()})
            (void)each->correct(sample);
    }
    EXPECT_NE(along_z->predict(0.05).position, along_y->predict(0.05).position);
    EXPECT_EQ(along_z->predict(0.05).position, named->predict(0.05).position);
}

}  // namespace
