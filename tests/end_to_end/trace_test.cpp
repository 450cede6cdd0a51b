// `musicworld trace ...` as a user runs it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "program.h"
#include "shared_folder.h"

namespace end_to_end {
namespace {

using Rows = std::vector<std::map<std::string, std::string>>;

Rows rows_of(const std::filesystem::path& trace) {
    std::string text = read(trace);
    while (text.starts_with('#')) text.erase(0, text.find('\n') + 1);
    const Folder folder;
    write(folder / "rows.csv", text);
    return read_csv(folder / "rows.csv");
}

double number(const Rows& rows, std::size_t row, const char* column) {
    return std::stod(rows.at(row).at(column));
}

/// A table of another program: centimetres, z up, milliseconds, Euler degrees.
std::string table() {
    std::string text = "Clock;East;North;Height;Roll;Pitch;Yaw\n";
    for (int k = 0; k < 400; ++k)
        text += std::to_string(5 * k) + ";" + std::to_string(30 * std::sin(0.05 * k)) + ";10;" +
                std::to_string(80 + 20 * std::cos(0.15 * k)) + ";90;0;0\n";
    return text;
}

const std::vector<std::string> kMapped = {
    "--map",       "t=Clock,px=East,py=North,pz=Height,ex=Roll,ey=Pitch,ez=Yaw",
    "--units",     "cm",
    "--up",        "z",
    "--euler",     "XYZ",
    "--separator", "semicolon",
    "--time-unit", "ms"};

std::vector<std::string> convert(const std::vector<std::string>& in, const std::filesystem::path& out,
                                 const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"trace", "convert"};
    all.insert(all.end(), in.begin(), in.end());
    all.insert(all.end(), {"--out", out.string()});
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

TEST(TraceConvert, ATableBecomesATraceAndItsSavedMapDoesTheSame) {
    const Folder folder;
    write(folder / "in.txt", table());
    std::vector<std::string> options = kMapped;
    options.insert(options.end(),
                   {"--save-map", (folder / "map.toml").string(), "--tip", "0,0,-0.35", "--shaft", "-x"});
    const Ended ended = run(convert({(folder / "in.txt").string()}, folder / "a.csv", options));
    ASSERT_EQ(ended.status, 0) << ended.err;
    EXPECT_EQ(ended.err, "");
    ASSERT_EQ(run(convert({(folder / "in.txt").string()}, folder / "b.csv",
                          {"--map", (folder / "map.toml").string()}))
                  .status,
              0);
    EXPECT_EQ(read(folder / "a.csv"), read(folder / "b.csv"));
    const Rows rows = rows_of(folder / "a.csv");
    ASSERT_EQ(rows.size(), 400u);
    EXPECT_NEAR(number(rows, 100, "t"), 0.5, 1e-12);
    EXPECT_NEAR(number(rows, 100, "px"), 0.3 * std::sin(5.0), 1e-8);
    EXPECT_NEAR(number(rows, 100, "py"), 0.8 + 0.2 * std::cos(15.0), 1e-8) << "the height";
    EXPECT_NEAR(number(rows, 100, "pz"), -0.1, 1e-12);
    EXPECT_NEAR(number(rows, 100, "qw"), 1, 1e-12) << "90 degrees about x undo the turn of the axes";
    EXPECT_EQ(run({"trace", "check", (folder / "a.csv").string()}).status, 0);
}

TEST(TraceConvert, WrongUnitsAreWarnedAboutInOneLineAndTheTraceIsStillWritten) {
    const Folder folder;
    write(folder / "in.txt", table());
    std::vector<std::string> options = kMapped;
    options[3] = "m";
    const Ended ended = run(convert({(folder / "in.txt").string()}, folder / "a.csv", options));
    EXPECT_EQ(ended.status, 0);
    EXPECT_NE(ended.err.find("in.txt: warning: positions range over "), std::string::npos) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "a.csv"));
    const Ended info = run({"trace", "info", "--json", (folder / "a.csv").string()});
    EXPECT_EQ(nlohmann::json::parse(info.out).at("warnings").size(), 1u);
}

TEST(TraceConvert, ABundledTraceByNameIsSeenByAnotherSensorTheSameOnEveryRun) {
    const Folder folder;
    const std::vector<std::string> sensor = {"--resample", "60", "--noise",    "0.5", "--noise-rad", "0.002",
                                             "--jitter",   "2",  "--drop-out", "0.1", "--burst",     "4",
                                             "--latency",  "20", "--quantum",  "0.1", "--seed",      "7"};
    ASSERT_EQ(run(convert({"flourish"}, folder / "a.csv", sensor)).status, 0);
    ASSERT_EQ(run(convert({"flourish"}, folder / "b.csv", sensor)).status, 0);
    EXPECT_EQ(read(folder / "a.csv"), read(folder / "b.csv"));
    const auto of = [&](const std::filesystem::path& trace) {
        const Ended ended = run({"trace", "info", "--json", trace.string()});
        return nlohmann::json::parse(ended.out);
    };
    const nlohmann::json before = of("flourish"), after = of(folder / "a.csv");
    EXPECT_EQ(after.at("rate_hz").get<double>(), 60);
    EXPECT_GT(after.at("t0_s").get<double>(), before.at("t0_s").get<double>() + 0.010);
    const double expected = 0.9 * 60 * before.at("duration_s").get<double>();
    EXPECT_NEAR(after.at("sticks")[0].at("samples").get<double>(), expected, 0.1 * expected);
    std::vector<std::string> other = sensor;
    other.back() = "8";
    ASSERT_EQ(run(convert({"flourish"}, folder / "c.csv", other)).status, 0);
    EXPECT_NE(read(folder / "a.csv"), read(folder / "c.csv"));
}

TEST(TraceConvert, WhatCannotBeIsRefusedInOneLineWithItsPlace) {
    const Folder folder;
    write(folder / "in.txt", table());
    write(folder / "broken.bsor", "\x69\x3d\x2d\x44\x01");
    const std::string in = (folder / "in.txt").string();
    std::vector<std::string> too_slow = kMapped;  // two seconds
    too_slow.insert(too_slow.end(), {"--resample", "0.1"});
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
        {convert({in}, folder / "o.csv"), "in.txt:1:1: error: found"},
        {convert({in}, folder / "o.csv", {"--map", "px=East"}), "py"},
        {convert({in}, folder / "o.csv", {"--map", "nowhere"}), "nowhere"},
        {convert({in}, folder / "o.csv", {"--map", "px=East,py=North,pz=Height", "--separator", "semicolon"}),
         "--rate"},
        {convert({in}, folder / "o.csv", {"--map", "px=West,py=North,pz=Height", "--separator", "semicolon"}),
         "'West'"},
        {convert({in}, folder / "o.csv", {"--map", "tum", "--units", "furlong"}), "furlong"},
        {convert({(folder / "broken.bsor").string()}, folder / "o.csv"), "broken.bsor:byte 5: error: found"},
        {convert({(folder / "none.bsor").string()}, folder / "o.csv"), "none.bsor"},
        {convert({"flourish", "roll"}, folder / "o.csv"), "2 files"},
        {convert({"flourish"}, folder / "o.csv", {"--rate", "100"}), "--rate"},
        {convert({"flourish"}, folder / "o.csv", {"--drop-out", "0.95"}), "--drop-out"},
        {convert({"flourish"}, folder / "o.csv", {"--noise", "nan"}), "--noise"},
        {convert({"flourish"}, folder / "o.csv", {"--resample", "-1"}), "--resample"},
        {convert({in}, folder / "o.csv", too_slow), "samples of stick"},
        {{"trace", "dance"}, "info, check, synth or convert"},
    };
    for (const auto& [arguments, place] : cases) {
        const Ended ended = run(arguments);
        EXPECT_EQ(ended.status, 2) << arguments.back();
        EXPECT_NE(ended.err.find(place), std::string::npos) << place << " is not in: " << ended.err;
        EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "o.csv")) << arguments.back();
    }
}

/// Largest differences of two traces in the same rows.
void expect_same_numbers(const std::filesystem::path& a, const std::filesystem::path& b) {
    const Rows left = rows_of(a), right = rows_of(b);
    ASSERT_EQ(left.size(), right.size());
    ASSERT_GT(left.size(), 1000u);
    for (std::size_t i = 0; i < left.size(); ++i) {
        ASSERT_EQ(left[i].at("stick"), right[i].at("stick"));
        // The converted files have six decimals of s and m (half of the last one, and rounding), seven of q.
        for (const char* column : {"t", "px", "py", "pz"})
            ASSERT_NEAR(number(left, i, column), number(right, i, column), 0.51e-6) << i << column;
        for (const char* column : {"qw", "qx", "qy", "qz"})
            ASSERT_NEAR(number(left, i, column), number(right, i, column), 1.5e-7) << i << column;
    }
}

TEST(TraceConvert, OriginalRecordingsReadToTheNumbersOfTheirConvertedFiles) {
    const std::optional<std::filesystem::path> shared = shared_folder();
    if (!shared) GTEST_SKIP() << "there are no recordings beside the checkout";
    const std::filesystem::path traces = *shared / "traces";
    const Folder folder;
    const auto same = [&](const std::vector<std::string>& originals, const std::string& converted,
                          const std::vector<std::string>& options) {
        std::vector<std::string> in;
        for (const std::string& original : originals) in.push_back((traces / "raw" / original).string());
        const Ended ended = run(convert(in, folder / "a.csv", options));
        ASSERT_EQ(ended.status, 0) << ended.err;
        EXPECT_EQ(ended.err, "");
        ASSERT_EQ(run(convert({(traces / converted).string()}, folder / "b.csv")).status, 0);
        expect_same_numbers(folder / "a.csv", folder / "b.csv");
    };
    same({"p3_index_bang.bsor"}, "beatsaber/p3_index_bang.csv", {});
    for (const std::string take : {"AccentCenter", "PistonNormal"})
        same({"vicon_" + take + "_left1.csv", "vicon_" + take + "_right1.csv"},
             "timpani/" + take + "_take1.csv", {"--rate", "250"});
}

TEST(TraceCheck, NoRecordingIsTakenForImplausible) {
    const std::optional<std::filesystem::path> shared = shared_folder();
    if (!shared) GTEST_SKIP() << "there are no recordings beside the checkout";
    std::vector<std::string> arguments = {"trace", "check", "flourish", "feints", "roll"};
    for (const char* folder : {"beatsaber", "timpani", "drumstick"})
        for (const auto& entry : std::filesystem::directory_iterator(*shared / "traces" / folder)) {
            const std::string name = entry.path().filename().string();
            if (name.find(".hits.") == std::string::npos && name.find(".flags.") == std::string::npos)
                arguments.push_back(entry.path().string());
        }
    EXPECT_GT(arguments.size(), 30u);
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.status, 0);
    EXPECT_EQ(ended.err, "");
}

}  // namespace
}  // namespace end_to_end
