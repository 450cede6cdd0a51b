#include <gtest/gtest.h>

#include <cmath>

#include "mutation.h"
#include "trace/c3d_writer.h"
#include "tracking/import.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

std::array<double, 3> at(double x, double y, double z) {
    return {x, y, z};
}

C3dWriter two_markers() {
    C3dWriter file;
    file.labels = {"HAND", "TIP"};
    for (int k = 0; k < 4; ++k)
        file.frames.push_back({at(100 + 10 * k, 200, 1000), at(100 + 10 * k, 600, 1000)});
    return file;
}

ColumnMap markers(std::map<std::string, std::string> columns) {
    ColumnMap map;
    map.columns = std::move(columns);
    return map;
}

void expect_refused(const std::string& bytes, const ColumnMap& map, const std::string& found) {
    try {
        (void)read_markers(bytes, "fuzz.c3d", map);
        ADD_FAILURE() << "read: " << found;
    } catch (const TraceError& error) {
        expect_located(error.what());
        EXPECT_NE(std::string(error.what()).find(found), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find(":byte "), std::string::npos) << error.what();
    }
}

TEST(C3d, EachProcessorsIntegersAndFloatsReadToTheSamePoints) {
    for (const C3dWriter::Processor processor : {C3dWriter::intel, C3dWriter::dec, C3dWriter::mips})
        for (const bool floating : {true, false}) {
            C3dWriter file = two_markers();
            file.processor = processor, file.floating = floating;
            file.frames[2][0] = std::nullopt;
            file.frames[3][1] = at(-12.5, 0, -3276.5);
            const std::string bytes = file.bytes();
            ASSERT_TRUE(is_c3d(bytes));
            const Trace trace = parse_trace(bytes, "take.c3d");
            ASSERT_EQ(trace.sticks.size(), 2u) << "without a map each point is a stick";
            EXPECT_EQ(trace.sticks[0].name, "HAND");
            EXPECT_EQ(trace.rate_hz, 200);
            ASSERT_EQ(trace.sticks[0].samples.size(), 3u) << "residual -1: not seen";
            EXPECT_EQ(trace.remarks,
                      std::vector<std::string>{"left out 1 frames in which HAND was not seen"});
            EXPECT_EQ(trace.sticks[0].samples[2].t_s, 3 / 200.0);
            // z up, mm: (x, y, z) becomes (x, z, -y); 0.1 is no float, so an integer's scale errs by 2e-8
            EXPECT_LT((trace.sticks[0].samples[1].position - Vector3d(0.11, 1, -0.2)).norm(), 1e-7);
            EXPECT_LT((trace.sticks[1].samples[3].position - Vector3d(-0.0125, -3.2765, 0)).norm(), 1e-6);
            EXPECT_FALSE(trace.sticks[0].samples[0].has_orientation);
        }
}

TEST(C3d, UnitsAndAxesAreTheFilesUnlessTheMapSaysThem) {
    const auto first = [](const C3dWriter& file, const ColumnMap& map) {
        return read_markers(file.bytes(), "take.c3d", map).sticks.at(0).samples.at(0).position;
    };
    C3dWriter file = two_markers();
    file.frames[0][0] = at(1, 2, 3);
    for (const auto& [units, metre] : {std::pair("m", 1.0), {"cm", 0.01}, {"mm   ", 0.001}}) {
        file.units = units;
        EXPECT_LT((first(file, {}) - metre * Vector3d(1, 3, -2)).norm(), 1e-15);
    }
    file.units = "m", file.x_screen = "-X", file.y_screen = "-Z";
    EXPECT_EQ(first(file, {}), Vector3d(1, 3, -2)) << "programs write -Z where z points up";
    file.y_screen = "+Y";
    EXPECT_EQ(first(file, {}), Vector3d(1, 2, 3));
    file.x_screen = "+Y", file.y_screen = "+X";
    EXPECT_EQ(first(file, {}), Vector3d(2, 1, -3)) << "right-handed: back is right times up, -z here";
    file.x_screen = file.y_screen = "";
    EXPECT_EQ(first(file, {}), Vector3d(1, 3, -2)) << "z up where the file does not say";
    ColumnMap said;
    said.frame = "RUB", said.metres_per_unit = 0.5, said.rate_hz = 10;
    EXPECT_EQ(first(file, said), Vector3d(0.5, 1, 1.5));
    EXPECT_EQ(read_markers(file.bytes(), "take.c3d", said).rate_hz, 10);
    file.units = "furlong";
    expect_refused(file.bytes(), {}, "units of points that are no length");
}

TEST(C3d, TwoMarkersGiveTheShaftAndTurnNoFurtherThanTheyMust) {
    C3dWriter file;
    file.labels = {"S:HAND", "S:TIP"};
    file.y_screen = "+Y", file.units = "m", file.scale = 1e-4;
    for (int k = 0; k <= 90; ++k) {  // the shaft swings by a degree a frame about z, at a right angle to it
        const double a = k * M_PI / 180;
        file.frames.push_back({at(0, 1, 0), at(0.4 * std::sin(a), 1 + 0.4 * std::cos(a), 0)});
    }
    const Trace trace =
        read_markers(file.bytes(), "take.c3d", markers({{"left.marker", "*HAND"}, {"left.marker2", "*TIP"}}));
    ASSERT_EQ(trace.sticks.size(), 1u);
    EXPECT_EQ(trace.sticks[0].name, "left");
    EXPECT_EQ(trace.shaft, -Vector3d::UnitZ());
    ASSERT_TRUE(trace.tip);
    EXPECT_LT((*trace.tip - Vector3d(0, 0, -0.4)).norm(), 1e-7) << "floats";
    const std::vector<PoseSample>& s = trace.sticks[0].samples;
    for (std::size_t k = 0; k < s.size(); ++k) {
        ASSERT_TRUE(s[k].has_orientation);
        const double a = static_cast<double>(k) * M_PI / 180;
        EXPECT_LT((s[k].orientation * -Vector3d::UnitZ() - Vector3d(std::sin(a), std::cos(a), 0)).norm(),
                  1e-6);
    }
    const Quaterniond swung = s.back().orientation * s.front().orientation.conjugate();
    EXPECT_LT(swung.angularDistance(exponential({0, 0, -M_PI / 2})), 1e-5) << "90 steps of floats; no roll";
}

TEST(C3d, ThreeMarkersGiveTheOrientation) {
    const Quaterniond turn = exponential({0.4, -0.9, 1.7});
    const Vector3d hand(0.2, 1.1, -0.3), tip = hand + turn * Vector3d(0, 0, -0.35),
                                         side = hand + turn * Vector3d(0.05, 0, 0.02);
    C3dWriter file;
    file.labels = {"A", "B", "C"};
    file.y_screen = "+Y", file.units = "m", file.scale = 1e-4;
    const auto of = [](const Vector3d& p) { return at(p.x(), p.y(), p.z()); };
    for (int k = 0; k < 4; ++k) file.frames.push_back({of(hand), of(tip), of(side)});
    file.frames[1][2] = std::nullopt;
    file.frames[2][0] = std::nullopt;
    const ColumnMap map = markers({{"right.marker", "A"}, {"right.marker2", "B"}, {"right.marker3", "C"}});
    const Trace trace = read_markers(file.bytes(), "take.c3d", map);
    const std::vector<PoseSample>& s = trace.sticks.at(0).samples;
    ASSERT_EQ(s.size(), 3u) << "without its tracked marker a stick is not seen";
    EXPECT_LT((s[0].orientation.toRotationMatrix() - turn.toRotationMatrix()).norm(), 3e-6)
        << "floats of 1 m, 0.05 m apart: 1.2e-7 / 0.05";
    EXPECT_FALSE(s[1].has_orientation) << "one of the three is missing";
    EXPECT_EQ(s[1].orientation.coeffs(), s[0].orientation.coeffs()) << "the newest known one";
    EXPECT_TRUE(s[2].has_orientation);
}

TEST(C3d, LabelsGoOnInASecondBlockAndMoreThan64PointsNeedAMap) {
    C3dWriter file;
    for (int i = 0; i < 300; ++i) file.labels.push_back("M" + std::to_string(i));
    file.frames.assign(2, std::vector<std::optional<std::array<double, 3>>>(300, at(0, 0, 0)));
    file.frames[1][299] = at(1000, 0, 0);
    const std::string bytes = file.bytes();
    const Trace trace = read_markers(bytes, "take.c3d", markers({{"a.marker", "M299"}}));
    EXPECT_LT((trace.sticks.at(0).samples[1].position - Vector3d(1, 0, 0)).norm(), 1e-12);
    expect_refused(bytes, {}, "300 points");
    expect_refused(bytes, markers({{"a.marker", "M300"}}), "no point 'M300'");
    expect_refused(bytes, markers({{"a.marker", "M1*"}}), "two points 'M1*'");
}

TEST(C3d, LongTrialsAreCountedByTheParametersMadeForThem) {
    C3dWriter file;
    file.labels = {"A"};
    file.analog = 0, file.floating = false;
    for (int k = 0; k < 70000; ++k) file.frames.push_back({at(0.1 * (k % 1000), 0, 0)});
    file.frames_said = 65535;
    EXPECT_EQ(parse_trace(file.bytes(), "a.c3d").sticks[0].samples.size(), 65535u);
    file.trial = true;
    EXPECT_EQ(parse_trace(file.bytes(), "a.c3d").sticks[0].samples.size(), 70000u);
    file.trial = false, file.long_frames = 70000;
    EXPECT_EQ(parse_trace(file.bytes(), "a.c3d").sticks[0].samples.size(), 70000u);
    file.long_frames = 70001;
    expect_refused(file.bytes(), {}, "70001 frames, expected at most the 70000");
}

TEST(C3d, MapsOfMarkersAreChecked) {
    const std::string bytes = two_markers().bytes();
    for (const auto& columns :
         std::vector<std::map<std::string, std::string>>{{{"left.marker2", "TIP"}},
                                                         {{"left.marker", "HAND"}, {"left.marker3", "TIP"}},
                                                         {{"left.marker", "HAND"}, {"left.px", "X"}},
                                                         {{"left.marker", ""}},
                                                         {{"left.marker4", "HAND"}}})
        EXPECT_THROW(markers(columns).check(), std::invalid_argument) << columns.begin()->first;
    EXPECT_THROW((void)read_markers(bytes, "a", markers({{"px", "X"}, {"py", "Y"}, {"pz", "Z"}})),
                 std::invalid_argument);
    ColumnMap frame;
    frame.frame = "RUR";
    EXPECT_THROW((void)read_markers(bytes, "a", frame), std::invalid_argument);
}

TEST(C3d, NumbersThatCountNothingAreRefused) {
    for (const double number : {double{NAN}, double{INFINITY}, 0.5, 65536.0, -1.0}) {
        C3dWriter file = two_markers();
        file.points_said = number;
        expect_refused(file.bytes(), {}, "points, expected 1 to 65535");
    }
    for (const double number : {double{NAN}, double{INFINITY}, -double{INFINITY}}) {
        C3dWriter file = two_markers();
        file.long_frames = number;
        expect_refused(file.bytes(), {}, std::isnan(number) ? "nan frames" : "inf frames");
        file = two_markers();
        file.rate_hz = number;
        expect_refused(file.bytes(), {}, "a rate of ");
        file = two_markers();
        file.scale = number;
        expect_refused(file.bytes(), {}, "a scale of ");
    }
    C3dWriter file = two_markers();
    file.data_start = INFINITY;
    expect_refused(file.bytes(), {}, "data in block inf");
    file.data_start = NAN;
    EXPECT_EQ(parse_trace(file.bytes(), "a.c3d").sticks.size(), 2u) << "the header's block counts";
}

TEST(C3d, EachPointGetsANameOfItsOwn) {
    C3dWriter file = two_markers();
    file.labels = {"A", "point3", "A"};
    for (auto& frame : file.frames) frame.push_back(at(1, 2, 3));
    const Trace trace = parse_trace(file.bytes(), "a.c3d");
    ASSERT_EQ(trace.sticks.size(), 3u);
    EXPECT_EQ(trace.sticks[1].name, "point3");
    EXPECT_EQ(trace.sticks[2].name, "point4");
}

TEST(C3d, DamagedFilesAreRefusedWithTheirPlace) {
    C3dWriter file = two_markers();
    const std::string whole = file.bytes();
    expect_refused(whole.substr(0, 600), {}, "the end of the file");
    expect_refused(whole.substr(0, whole.size() - 40), {}, "4 frames, expected at most the 3");
    file.rate_hz = -1;
    expect_refused(file.bytes(), {}, "a rate of -1");
    file = two_markers();
    file.frames[1][0] = at(1e9, 0, 0);
    expect_refused(file.bytes(), {}, "a coordinate that is no number within 1000 m");
    std::mt19937 random(5);
    Outcomes outcomes;
    for (const C3dWriter::Processor processor : {C3dWriter::intel, C3dWriter::dec, C3dWriter::mips})
        for (int i = 0; i < 2000; ++i) {
            file = two_markers();
            file.processor = processor;
            try {
                const Trace trace = parse_trace(mutated(file.bytes(), random), "fuzz.c3d");
                expect_valid(trace);
                ++outcomes.read;
            } catch (const TraceError& error) {
                expect_located(error.what());
                ++outcomes.refused;
            }
        }
    EXPECT_GT(outcomes.read, 100) << "descriptions, unused parameters and coordinates may change";
    EXPECT_GT(outcomes.refused, 100);
}

}  // namespace
}  // namespace tracking
