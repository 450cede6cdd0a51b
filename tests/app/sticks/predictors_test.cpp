#include "sticks/predictors.h"

#include <gtest/gtest.h>

#include "files/bad_input.h"

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
    for (const char* good : {"auto", "cv:q=1e8,gate=5", "exec:does not start here"})
        EXPECT_NO_THROW(app::check_specification(good)) << good;
    for (const char* bad : {"", "oracle", "ca:q=much", "auto:q=1", "exec:", "exec:  ", "exec"}) {
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

}  // namespace
