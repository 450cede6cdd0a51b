#include "commands/command.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "files/bad_input.h"

namespace app {
namespace {

template <class Value>
std::string refusal(const ValueFormat<Value>& format, const std::string& text) {
    try {
        (void)format.parse(text, "--x");
        return "nothing thrown";
    } catch (const BadInput& wrong) {
        return wrong.what();
    }
}

TEST(ValueFormats, NumbersMayBeFractionsAndHaveARangeAndAUnit) {
    EXPECT_EQ(as::number(0, 1).parse("1/15", "--x"), 1.0 / 15);
    EXPECT_EQ(as::number(0, 1000, "mm", 1000).parse("2.5", "--x"), 0.0025);
    EXPECT_EQ(refusal(as::number(1, 1000, "Hz"), "0"),
              "error: found --x 0, expected a number from 1 to 1000 Hz");
    EXPECT_EQ(refusal(as::number_above(0, 1e15, "Pa"), "0"),
              "error: found --x 0, expected a number above 0, up to 1e+15 Pa");
    for (const char* text : {"", "fast", "nan", "inf", "1/0", "1.0x", "1001", "0.999"})
        EXPECT_NE(refusal(as::number(1, 1000), text), "nothing thrown") << text;
    for (const char* text : {"-1", "0.5"})
        EXPECT_NE(refusal(as::number_between(-1, 0.5), text), "nothing thrown") << text;
    for (const char* text : {"-1", "65", "1.5", "many", "99999999999999999999"})
        EXPECT_EQ(refusal(as::whole(0, 64), text),
                  std::string("error: found --x ") + text + ", expected a whole number from 0 to 64");
}

TEST(ValueFormats, VectorsAxesSizesAndListsHaveAllTheirParts) {
    EXPECT_EQ(as::vector_of_3(as::number(-2, 2)).parse("1,-1/2,0", "--x"), Eigen::Vector3d(1, -0.5, 0));
    EXPECT_EQ(as::axis().parse("-z", "--x"), Eigen::Vector3d(0, 0, -1));
    EXPECT_EQ(as::pixels(16, 4096).parse("640x480", "--x"), Eigen::Vector2i(640, 480));
    EXPECT_EQ(as::list_of(as::whole(1, 9)).parse("3,1", "--x"), (std::vector<std::int64_t>{3, 1}));
    const std::pair<std::string, std::string> last{"a=b", "c"}, first{"a", "b=c"};
    EXPECT_EQ(as::named("T=N", as::PartedAt::last).parse("a=b=c", "--x"), last);
    EXPECT_EQ(as::named("T=N").parse("a=b=c", "--x"), first);
    for (const char* text : {"1,2", "1,2,3,4", "1,2,", "1,2,3.1"})
        EXPECT_NE(refusal(as::vector_of_3(as::number(-3, 3)), text), "nothing thrown") << text;
    for (const char* text : {"", "-", "w", "zz", "--z"})
        EXPECT_NE(refusal(as::axis(), text), "nothing thrown") << text;
    for (const char* text : {"640", "x", "640x", "15x16", "16x4097", "640x480x2"})
        EXPECT_NE(refusal(as::pixels(16, 4096), text), "nothing thrown") << text;
    for (const char* text : {"", "1,", "1,1", "1,10"})
        EXPECT_NE(refusal(as::list_of(as::whole(1, 9)), text), "nothing thrown") << text;
    for (const char* text : {"", "=", "a=", "=b", "ab"})
        EXPECT_NE(refusal(as::named("N=F"), text), "nothing thrown") << text;
}

struct Sizes {
    double fps = 30, lead_s = 1.0 / 15, noise_m = 0.0025;
    std::optional<int> count;
    bool automatic = false, cancelling = true;
    std::vector<double> leads = {0.5};
    std::vector<std::string> traces;
};

/// A command with an option of each kind over `sizes`.
void declare(Command& command, Sizes& sizes) {
    command.options("TRACE", sizes.traces, as::text("TRACE"), "Traces");
    command.option("--fps", sizes.fps, as::number(1, 1000, "frames per second"), "Frame rate");
    command.option("--lead", sizes.lead_s, as::number(0, 1, "s"), "Lead");
    command.option("--noise", sizes.noise_m, as::number(0, 10, "mm", 1000), "Noise");
    command.option("--count", sizes.count, as::whole(1, 9), "Count");
    command.option("--mode", sizes.automatic, as::choice<bool>({{"fixed", false}, {"auto", true}}), "Mode");
    command.option("--leads", sizes.leads, as::list_of(as::number(0, 1, "s")), "Leads");
    command.flag("--no-cancel", sizes.cancelling, "Play all", false);
    command.runs([] {});
}

void parse(Sizes& sizes, std::vector<std::string> words) {
    CLI::App tree("test");
    Command command(tree);
    declare(command, sizes);
    std::reverse(words.begin(), words.end());
    tree.parse(words);
}

TEST(Commands, FillTheVariablesOfTheirOptions) {
    Sizes sizes;
    parse(sizes, {"a", "b", "--fps", "60", "--count=3", "--mode", "auto", "--no-cancel", "--leads", "1/4,0"});
    EXPECT_EQ(sizes.traces, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(sizes.fps, 60);
    EXPECT_EQ(sizes.lead_s, 1.0 / 15);
    EXPECT_EQ(sizes.count, 3);
    EXPECT_TRUE(sizes.automatic);
    EXPECT_FALSE(sizes.cancelling);
    EXPECT_EQ(sizes.leads, (std::vector<double>{0.25, 0}));
}

TEST(Commands, StateRangeUnitAndDefaultInTheHelp) {
    CLI::App tree("test");
    Command command(tree);
    Sizes sizes;
    declare(command, sizes);
    const std::string help = tree.help();
    for (const char* words :
         {"Frame rate [from 1 to 1000 frames per second; default 30]", "Lead [from 0 to 1 s; default 1/15]",
          "Noise [from 0 to 10 mm; default 2.5]", "Count [from 1 to 9]", "Mode [default fixed]",
          "--mode fixed|auto", "Leads [each from 0 to 1 s; default 0.5]"})
        EXPECT_NE(help.find(words), std::string::npos) << words << " in:\n" << help;
}

TEST(Commands, RefuseBadValuesOnlyAfterMisspeltNames) {
    Sizes sizes;
    EXPECT_THROW(parse(sizes, {"--fps", "0"}), BadInput);
    EXPECT_THROW(parse(sizes, {"--fps", "0", "--fsp", "3"}), CLI::ParseError);
    EXPECT_THROW(parse(sizes, {"--fps", "0", "--help"}), CLI::CallForHelp);
    EXPECT_THROW(parse(sizes, {"--fps", "1", "--fps", "2"}), CLI::ParseError);
}

}  // namespace
}  // namespace app
