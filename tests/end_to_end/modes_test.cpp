// `modes`, as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"

namespace end_to_end {
namespace {

using Json = nlohmann::json;

std::vector<std::string> modes_of(const std::string& size, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"modes",     "--size", size,        "--young", "1",
                                          "--poisson", "0.3",    "--density", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

Json json_of(const std::vector<std::string>& arguments) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.status, 0) << ended.err;
    EXPECT_TRUE(ended.err.empty()) << ended.err;
    return Json::parse(ended.out);
}

TEST(Modes, JsonHasTheKeysOfTheContractAndAll81EigenvaluesOfOneElement) {
    const Json document = json_of(modes_of("1,2,3", {"--json"}));
    EXPECT_EQ(document["size_m"], Json({1.0, 2.0, 3.0}));
    EXPECT_EQ(document["young_pa"], 1.0);
    EXPECT_EQ(document["poisson"], 0.3);
    EXPECT_EQ(document["density_kg_m3"], 1.0);
    EXPECT_EQ(document["elements_per_side"], 1);
    const std::vector<double> eigenvalues = document["eigenvalues_rad2_s2"],
                              frequencies = document["frequencies_hz"],
                              errors = document["discretisation_error"];
    ASSERT_EQ(eigenvalues.size(), 81U);
    ASSERT_EQ(frequencies.size(), 81U);
    ASSERT_EQ(errors.size(), 81U);
    ASSERT_EQ(document["kinds"].size(), 81U);
    EXPECT_TRUE(std::is_sorted(eigenvalues.begin(), eigenvalues.end()));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_LT(std::abs(eigenvalues[i]), 1e-12 * eigenvalues.back());
    for (std::size_t i = 6; i < 81; ++i) {
        EXPECT_NEAR(frequencies[i], std::sqrt(eigenvalues[i]) / (2 * M_PI), 1e-15 * frequencies[i]);
        EXPECT_GT(errors[i], 0);
    }
}

TEST(Modes, EigenvaluesAreThoseOfTheReferenceTo1em9) {
    std::ifstream file(MUSICWORLD_SOURCE_DIR "/tests/reference/free_vibration_modes.json");
    const Json reference = Json::parse(file);
    for (const auto& [name, size] :
         {std::pair<std::string, std::string>{"cube_nu0.3", "1,1,1"}, {"box123_nu0.3", "1,2,3"}})
        for (const auto& [list, elements] : {std::pair<std::string, std::string>{"eigenvalues", "1"},
                                             {"mesh_2x2x2", "2"},
                                             {"mesh_4x4x4", "4"}}) {
            const std::vector<double> expected = reference[name][list];
            const std::vector<double> found =
                json_of(modes_of(size, {"--json", "--elements", elements}))["eigenvalues_rad2_s2"];
            ASSERT_GE(found.size(), expected.size());
            for (std::size_t i = 6; i < expected.size(); ++i)
                EXPECT_NEAR(found[i] / expected[i], 1, 1e-9) << name << ' ' << list << ' ' << i;
        }
}

TEST(Modes, CountSaysWhatItCutAndFractionsAreNumbers) {
    const Json document = json_of(modes_of("1/2,1/2,1/2", {"--json", "--count", "12"}));
    EXPECT_EQ(document["eigenvalues_rad2_s2"].size(), 18U);
    EXPECT_EQ(document["cut"], Json({{"count", 12}, {"below", 11}, {"above", 14}}));
    // 12 G / (rho L^2)
    EXPECT_NEAR(document["eigenvalues_rad2_s2"][6].get<double>(), 12 / 2.6 / 0.25, 1e-10);
    const Ended table = run(modes_of("1/2,1/2,1/2", {"--count", "12"}));
    EXPECT_NE(table.out.find("whole groups end at 11 and 14"), std::string::npos) << table.out;
    EXPECT_NE(table.out.find("stretching"), std::string::npos);
    EXPECT_EQ(run(modes_of("1,1,1", {"--count", "11"})).out.find("whole groups"), std::string::npos);
}

// A sphere's five lowest modes are Lamb's torsional ones: omega R sqrt(rho / G) = 2.5011.
TEST(Modes, EstimatedErrorOfASphereLeadsToLambsFrequency) {
    const Json document =
        json_of(modes_of("2,2,2", {"--json", "--shape", "ellipsoid", "--elements", "2", "--count", "5"}));
    const double exact = 2.50113 * std::sqrt(1 / 2.6) / (2 * M_PI);
    for (std::size_t i = 6; i < 11; ++i) {
        const double frequency = document["frequencies_hz"][i], error = document["discretisation_error"][i];
        EXPECT_NEAR(frequency / (1 + error) / exact, 1, 2e-3) << error;
        EXPECT_GT(error, 1e-3);
    }
}

TEST(Modes, FramesDrawsAPictureAModeAndAllOfThemInOne) {
    const Folder folder;
    const std::string out = (folder / "out").string();
    const Ended ended = run(modes_of("1,2,3", {"--count", "4", "--frames", "--out", out, "--json"}));
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(ended.out, read(folder / "out/modes.json"));
    EXPECT_TRUE(std::filesystem::exists(folder / "out/modes.png"));
    const auto pictures = read_tree(folder / "out/frames", {});
    ASSERT_EQ(pictures.size(), 4U);
    for (const char* name : {"000001.png", "000002.png", "000003.png", "000004.png"})
        EXPECT_GT(pictures.at(name).size(), 10000U) << name;
    EXPECT_NE(pictures.at("000001.png"), pictures.at("000002.png"));
}

TEST(Modes, BadInputIsRefusedInOneLine) {
    const std::vector<std::vector<std::string>> cases = {
        modes_of("1,1", {}),
        modes_of("1,1,0", {}),
        modes_of("1,-1,1", {}),
        modes_of("1,1,nan", {}),
        modes_of("1,1,1/0", {}),
        modes_of("1,1,1", {"--shape", "ball"}),
        modes_of("1,1,1", {"--shape", "superquadric"}),
        modes_of("1,1,1", {"--shape", "superquadric", "--exponents", "1"}),
        modes_of("1,1,1", {"--shape", "superquadric", "--exponents", "1,2"}),
        modes_of("1,1,1", {"--exponents", "1,1"}),
        modes_of("1,1,1", {"--elements", "0"}),
        modes_of("1,1,1", {"--elements", "11"}),
        modes_of("1,1,1", {"--elements", "1.5"}),
        modes_of("1,1,1", {"--count", "0"}),
        modes_of("1,1,1", {"--frames"}),
        modes_of("1,1,1", {"--count", "1000000000000"}),
        {"modes", "--size", "1,1,1"},
        {"modes", "--size", "1,1,1", "--young", "0", "--poisson", "0.3", "--density", "1"},
        {"modes", "--size", "1,1,1", "--young", "1e309", "--poisson", "0.3", "--density", "1"},
        {"modes", "--size", "1,1,1", "--young", "1", "--poisson", "0.5", "--density", "1"},
        {"modes", "--size", "1,1,1", "--young", "1", "--poisson", "-1", "--density", "1"},
        {"modes", "--size", "1,1,1", "--young", "1", "--poisson", "0.3", "--density", "-1"},
    };
    for (const std::vector<std::string>& arguments : cases) expect_refused(run(arguments));
    EXPECT_EQ(run({"modes", "--size", "1,1,1", "--young", "1", "--poisson", "-0.3", "--density", "1"}).status,
              0);
}

}  // namespace
}  // namespace end_to_end
