#include "simulate/mishaps.h"

#include <gtest/gtest.h>

namespace app {
namespace {

TEST(Mishaps, ARunWithoutAnySaysNothing) {
    EXPECT_TRUE(Mishaps{}.lines().empty());
}

TEST(Mishaps, ALineOfEachKindHasCountNamesAndTheFirstStep) {
    Mishaps m;
    m.quarantined = {{"a", 3, "velocity"}, {"b", 4, "position"}};
    m.broken = {{"hook", 12}};
    m.limited = {{"c", 1}};
    EXPECT_EQ(m.lines(),
              (std::vector<std::string>{
                  "2 bodies taken out (beyond the world's range or not finite): a (velocity), b (position); "
                  "first at step 3",
                  "1 constraint broken (above the breaking force): hook; first at step 12",
                  "1 body held at the limit of deformation: c; first at step 1"}));
}

TEST(Mishaps, OfManyTheFirstEightAreNamed) {
    Mishaps m;
    for (int i = 0; i < 20; ++i) m.limited.push_back({"b/" + std::to_string(i), 7});
    EXPECT_EQ(m.lines(),
              std::vector<std::string>{"20 bodies held at the limit of deformation: b/0, b/1, b/2, b/3, b/4, "
                                       "b/5, b/6, b/7 and 12 more; first at step 7"});
}

}  // namespace
}  // namespace app
