#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "tracking/trace.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kHalf = std::numbers::sqrt2 / 2;

// A rotation composed from a few doubles carries a few rounding errors of 1e-16.
constexpr double kRounding = 1e-14;

double turn_between(const Quaterniond& a, const Quaterniond& b) {
    return a.angularDistance(b);
}

TEST(TraceReader, ReadsKeysSticksAndPosesOfTheFullFormat) {
    const Trace trace = parse_trace(
        "# units: m\n# up: y\n# rate_hz: 120\n# source: made up: by hand\n# tip_m: 0,0.5,-0.35\n# shaft: -z\n"
        "t,stick,px,py,pz,qw,qx,qy,qz\n"
        "0.5,left,1,2,3,1,0,0,0\n0.25,right,-1,-2,-3,0,1,0,0\n0.75,left,1.5,2,3,1,0,0,0\n0.75,right,0,0,0,0,"
        "1,0,0\n",
        "a.csv");
    ASSERT_EQ(trace.sticks.size(), 2u);
    EXPECT_EQ(trace.file, "a.csv");
    EXPECT_EQ(trace.source, "made up: by hand");
    EXPECT_EQ(trace.rate_hz, 120);
    EXPECT_EQ(trace.tip.value(), Vector3d(0, 0.5, -0.35));
    EXPECT_EQ(trace.shaft.value(), Vector3d(0, 0, -1));
    EXPECT_EQ(trace.sticks[0].name, "left");
    EXPECT_EQ(trace.sticks[1].name, "right");
    EXPECT_EQ(trace.sticks[0].samples[1].position, Vector3d(1.5, 2, 3));
    EXPECT_TRUE(trace.sticks[1].samples[0].has_orientation);
    EXPECT_EQ(trace.sticks[1].samples[0].orientation.x(), 1);
    EXPECT_EQ(trace.t0_s(), 0.25);
    EXPECT_EQ(trace.t_end_s(), 0.75);
}

TEST(TraceReader, WithoutKeysItIsMetresYUpWithoutTipOrRate) {
    const Trace trace = parse_trace("t,stick,px,py,pz\n0,a,1,2,3\n1,a,1,2,3", "a.csv");
    EXPECT_EQ(trace.rate_hz, 0);
    EXPECT_FALSE(trace.tip || trace.shaft);
    EXPECT_FALSE(trace.sticks[0].samples[0].has_orientation);
    EXPECT_EQ(trace.sticks[0].samples[0].position, Vector3d(1, 2, 3));
}

TEST(TraceReader, MillimetresScalePositionsButNotTheTipWhichIsInMetresByItsName) {
    const Trace trace =
        parse_trace("# units: mm\n# tip_m: 0,0,-0.35\nt,stick,px,py,pz\n0,a,123.5,2,3\n1,a,1,2,3\n", "a.csv");
    EXPECT_EQ(trace.sticks[0].samples[0].position, Vector3d(0.1235, 0.002, 0.003));
    EXPECT_EQ(trace.tip.value(), Vector3d(0, 0, -0.35));
}

TEST(TraceReader, ZUpTurnsPositionsAndOrientationsAndLeavesTheBodysTipAlone) {
    const std::string text =
        "# up: z\n# tip_m: "
        "0.1,0.2,0.3\nt,stick,px,py,pz,qw,qx,qy,qz\n0,a,1,2,3,0.6,0,0,0.8\n1,a,1,2,3,0.6,0,0,0.8\n";
    const Trace trace = parse_trace(text, "a.csv");
    const PoseSample& sample = trace.sticks[0].samples[0];
    EXPECT_EQ(sample.position, Vector3d(1, 3, -2));
    EXPECT_LT(
        turn_between(sample.orientation, Quaterniond(kHalf, -kHalf, 0, 0) * Quaterniond(0.6, 0, 0, 0.8)),
        1e-7);
    // The tip's place in the world is turned as a whole: convert(p + R tip) = p' + R' tip.
    const Vector3d z_up = Vector3d(1, 2, 3) + Quaterniond(0.6, 0, 0, 0.8) * Vector3d(0.1, 0.2, 0.3);
    const Vector3d y_up = sample.position + sample.orientation * trace.tip.value();
    EXPECT_LT((y_up - Vector3d(z_up.x(), z_up.z(), -z_up.y())).norm(), kRounding);
}

TEST(TraceReader, EmptyQuaternionColumnsMeanPositionOnlyForThatRow) {
    const Trace trace =
        parse_trace("t,stick,px,py,pz,qw,qx,qy,qz\n0,a,1,2,3,,,,\n1,a,1,2,3,0,0,1,0\n", "a.csv");
    EXPECT_FALSE(trace.sticks[0].samples[0].has_orientation);
    EXPECT_EQ(trace.sticks[0].samples[0].orientation.w(), 1);
    EXPECT_TRUE(trace.sticks[0].samples[1].has_orientation);
}

TEST(TraceReader, QuaternionsWithinOnePercentAreNormalisedAndKeepTheirHemisphere) {
    const Trace trace = parse_trace(
        "t,stick,px,py,pz,qw,qx,qy,qz\n0,a,0,0,0,0.995,0,0,0\n1,a,0,0,0,-0.9999,0.01,0,0\n2,a,0,0,0,0.9999,-"
        "0.01,0,0\n",
        "a.csv");
    for (const PoseSample& sample : trace.sticks[0].samples) {
        EXPECT_NEAR(sample.orientation.norm(), 1, kRounding);
        EXPECT_GT(sample.orientation.w(), 0.99);
    }
}

TEST(TraceReader, EightIncrementsOf45DegreesAboutTheBodysAxisMakeAFullTurn) {
    std::string text = "t,stick,px,py,pz,rx,ry,rz\n";
    for (int i = 0; i <= 8; ++i)
        text += std::to_string(i) + ",a,0,0,0,0," + (i == 0 ? "0" : "0.78539816339744831") + ",0\n";
    const Trace trace = parse_trace(text, "a.csv");
    const auto& samples = trace.sticks[0].samples;
    EXPECT_LT((samples[2].orientation * Vector3d::UnitX() - Vector3d(0, 0, -1)).norm(), kRounding);
    EXPECT_LT((samples[8].orientation * Vector3d::UnitX() - Vector3d::UnitX()).norm(), kRounding);
}

TEST(TraceReader, IncrementsTurnAboutBodyAxesEachStickOnItsOwn) {
    const Trace trace = parse_trace(
        "t,stick,px,py,pz,rx,ry,rz\n0,a,0,0,0,1.5707963267948966,0,0\n0,b,0,0,0,0,0,0\n1,a,0,0,0,0,1."
        "5707963267948966,0\n1,b,0,0,0,0,0,0\n",
        "a.csv");
    const Quaterniond expected = Quaterniond(kHalf, kHalf, 0, 0) * Quaterniond(kHalf, 0, kHalf, 0);
    EXPECT_LT((trace.sticks[0].samples[1].orientation.coeffs() - expected.coeffs()).norm(), kRounding);
    EXPECT_EQ(trace.sticks[1].samples[1].orientation.w(), 1);
}

TEST(TraceReader, EulerDegreesAreIntrinsicXYZ) {
    const Trace trace =
        parse_trace("t,stick,px,py,pz,ex,ey,ez\n0,a,0,0,0,30,40,50\n1,a,0,0,0,30,40,50\n", "a.csv");
    constexpr double kDegree = std::numbers::pi / 180;
    const Eigen::Matrix3d expected = (Eigen::AngleAxisd(30 * kDegree, Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(40 * kDegree, Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(50 * kDegree, Vector3d::UnitZ()))
                                         .toRotationMatrix();
    EXPECT_LT((trace.sticks[0].samples[0].orientation.toRotationMatrix() - expected).norm(), kRounding);
}

TEST(TraceReader, AcceptsCrLfByteOrderMarkBlanksTrailingEmptyLinesAndFreeComments) {
    const Trace trace = parse_trace(
        "\xEF\xBB\xBF# a comment without key\r\n# licence: none\r\n# units:  mm \r\n\r\nt, stick "
        ",px,py,pz\r\n 0 , st\xC3\xBC"
        "ck ,1000,+2,3\r\n1,st\xC3\xBC"
        "ck,1,2,3\r\n\r\n \r\n",
        "a.csv");
    EXPECT_EQ(trace.sticks[0].name,
              "st\xC3\xBC"
              "ck");
    EXPECT_EQ(trace.sticks[0].samples[0].position, Vector3d(1, 0.002, 0.003));
}

TEST(TraceReader, WrittenTracesReadBackToTheSameDoubles) {
    const Trace first = parse_trace(
        "# up: z\n# units: mm\n# rate_hz: 59.94\n# source: s\n# tip_m: 0.1,0,-0.35\n# shaft: +y\n"
        "t,stick,px,py,pz,qw,qx,qy,qz\n0.1,a,0.1,1e-7,123456.789,0.5,0.5,0.5,0.5001\n0.1,b,1,2,3,,,,\n"
        "0.30000000000000004,a,1,2,3,-0.5,-0.5,-0.5,-0.5\n0.2,b,1,2,3,0.6,0.8,0,0\n",
        "a.csv");
    const Trace again = parse_trace(format_trace(first), "b.csv");
    EXPECT_EQ(again.rate_hz, first.rate_hz);
    EXPECT_EQ(again.source, first.source);
    EXPECT_EQ(again.tip, first.tip);
    EXPECT_EQ(again.shaft, first.shaft);
    ASSERT_EQ(again.sticks.size(), first.sticks.size());
    for (std::size_t s = 0; s < first.sticks.size(); ++s)
        for (std::size_t i = 0; i < first.sticks[s].samples.size(); ++i) {
            const PoseSample& a = first.sticks[s].samples[i];
            const PoseSample& b = again.sticks[s].samples[i];
            EXPECT_EQ(a.t_s, b.t_s);
            EXPECT_EQ(a.position, b.position);
            EXPECT_EQ(a.has_orientation, b.has_orientation);
            EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
        }
}

/// A written trace, read and written again, is the same text: also where rounding decides a sign (turned from z up,
/// orthogonal orientations have a product of 1e-17 or so), sticks begin in another order than they stand, and a
/// replay's controller is named by blanks.
TEST(TraceWriter, WhatWasWrittenIsWrittenTheSameWhenItWasRead) {
    std::mt19937 rng(3);
    const auto component = [&] {
        return std::array{0.0, 0.5, -0.5, 1.0, -1.0, 0.1, -0.3, 0.7}.at(rng() % 8);
    };
    for (int k = 0; k < 3000; ++k) {
        std::string text = "# up: z\nt,stick,px,py,pz,qw,qx,qy,qz\n";
        for (int i = 0; i < 8; ++i) {
            Eigen::Quaterniond q(component(), component(), component(), component());
            if (q.norm() == 0) q.x() = 1;
            q.normalize();
            text +=
                std::to_string(i / 2 + (i % 2 == 0 ? 2 : 0)) + (i % 2 == 0 ? ",late" : ",early") + ",1,2,3";
            for (const double c : {q.w(), q.x(), q.y(), q.z()}) text += "," + std::to_string(c);
            text += "\n";
        }
        const std::string written = format_trace(parse_trace(text, "z_up.csv"));
        ASSERT_EQ(format_trace(parse_trace(written, "y_up.csv")), written) << text;
    }
    Trace trace = parse_trace("t,stick,px,py,pz\n0,a,1,2,3\n1,a,1,2,3\n", "a.csv");
    for (const char* source : {"Beat Saber Open Replay,  ", " ", "\t"}) {
        trace.source = source;
        const std::string written = format_trace(trace);
        EXPECT_EQ(format_trace(parse_trace(written, "b.csv")), written);
    }
}

TEST(TraceWriter, WritesRowsInOrderOfTimeAndRefusesWhatTheFormatCannotHold) {
    Trace trace = parse_trace("t,stick,px,py,pz\n0,a,1,2,3\n2,a,1,2,3\n1,b,1,2,3\n3,b,1,2,3\n", "a.csv");
    EXPECT_EQ(format_trace(trace),
              "# units: m\n# up: y\nt,stick,px,py,pz\n0,a,1,2,3\n1,b,1,2,3\n2,a,1,2,3\n3,b,1,2,3\n");
    trace.sticks[0].name = "two words";
    EXPECT_THROW((void)format_trace(trace), std::invalid_argument);
    trace.sticks[0].name = "a";
    trace.source = "two\nlines";
    EXPECT_THROW((void)format_trace(trace), std::invalid_argument);
    trace.source.clear();
    trace.shaft = Vector3d(0.6, 0.8, 0);
    EXPECT_THROW((void)format_trace(trace), std::invalid_argument);
}

TEST(TraceReader, ReadsFilesAsItReadsMemory) {
    const std::filesystem::path file =
        std::filesystem::path(testing::TempDir()) / "musicworld_trace_reader_test.csv";
    std::ofstream(file, std::ios::binary) << "t,stick,px,py,pz\n0,a,1,2,3\n1,a,1,2,3\n";
    EXPECT_EQ(read_trace(file).sticks[0].samples.size(), 2u);
    std::filesystem::remove(file);
}

}  // namespace
}  // namespace tracking
