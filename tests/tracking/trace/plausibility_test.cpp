#include "tracking/plausibility.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Two sticks that drum at 3 Hz for 20 s, 200 Hz, side by side: they turn about a wrist at rest that lies
/// 0.4 m behind the tracked point, down at constant speed and up again faster than down, so that the turn
/// below is the sharp one. They also sway about the vertical and roll, so that every axis is turned about.
/// `vigour` scales all turns.
Trace drumming(double vigour = 1) {
    Trace trace;
    trace.file = "t.csv";
    trace.shaft = -Vector3d::UnitZ();
    for (const double side : {-0.2, 0.2}) {
        StickTrace stick{side < 0 ? "left" : "right", {}};
        for (int k = 0; k < 4000; ++k) {
            const double t = 0.005 * k, phase = std::fmod(3 * t, 1);
            const double lift =
                vigour * 1.2 * std::abs(std::sin(M_PI * phase));  // a sharp turn at 0, a soft one on top
            const Quaterniond q = exponential({0, vigour * 0.9 * std::sin(7 * t), 0}) *
                                  exponential({lift, 0, 0}) *
                                  exponential({0, 0, vigour * 1.1 * std::sin(11 * t)});
            PoseSample sample;
            sample.t_s = t;
            sample.position = Vector3d(side, 0.9, 0) + q * Vector3d(0.05, 0.02, -0.4);
            sample.orientation = q;
            sample.has_orientation = true;
            stick.samples.push_back(sample);
        }
        trace.sticks.push_back(stick);
    }
    return trace;
}

template <class Change>
std::vector<std::string> after(Change change, double vigour = 1) {
    Trace trace = drumming(vigour);
    for (StickTrace& stick : trace.sticks)
        for (PoseSample& sample : stick.samples) change(sample);
    return implausible(trace);
}

/// One of the lines must say so.
void expect_said(const std::vector<std::string>& lines, const std::string& what) {
    for (const std::string& line : lines)
        if (line.find(what) != std::string::npos) return;
    ADD_FAILURE() << what << " is not among " << lines.size() << " lines"
                  << (lines.empty() ? "" : ": " + lines[0]);
}

TEST(Plausibility, DrummingIsNotRemarkedUpon) {
    EXPECT_EQ(implausible(drumming()), std::vector<std::string>{});
}

TEST(Plausibility, MillimetresReadAsCentimetresOrMetresAreNoticed) {
    expect_said(after([](PoseSample& s) { s.position *= 10; }), "more than hands do");
    expect_said(after([](PoseSample& s) { s.position *= 0.01; }), "less than hands that drum");
}

TEST(Plausibility, AnotherAxisUpIsNoticed) {
    const Quaterniond quarter = exponential({M_PI / 2, 0, 0});
    expect_said(after([&](PoseSample& s) {
                    s.position = quarter * s.position;
                    s.orientation = quarter * s.orientation;
                }),
                "stopped from the side");
    expect_said(after([](PoseSample& s) { s.position.y() *= -1; }), "stopped from the side");
}

TEST(Plausibility, OrientationsOfAnotherConventionAreNoticedAndTheConventionIsNamed) {
    expect_said(after([](PoseSample& s) { s.position.z() *= -1; }), "mirrored in z");
    expect_said(after([](PoseSample& s) { s.position.x() *= -1; }), "mirrored in x");
    expect_said(after([](PoseSample& s) { s.orientation = s.orientation.conjugate(); }), "inverse");
    expect_said(after([](PoseSample& s) {
                    const Quaterniond q = s.orientation;
                    s.orientation = Quaterniond(q.x(), q.y(), q.z(), q.w());
                }),
                "order x y z w");
}

TEST(Plausibility, AMirroredSceneOrSwappedNamesAreNoticed) {
    expect_said(after(
                    [](PoseSample& s) {
                        s.position.x() *= -1;
                        s.orientation = Quaterniond(s.orientation.w(), s.orientation.x(), -s.orientation.y(),
                                                    -s.orientation.z());
                    },
                    0.4),  // so that the shafts point ahead throughout
                "to the right of stick right for 100 % of the time, by 0.4 m");
}

TEST(Plausibility, ShortAndPositionOnlyTracesAreJudgedOnWhatTheyHold) {
    Trace trace = drumming();
    for (StickTrace& stick : trace.sticks) {
        stick.samples.resize(2);
        for (PoseSample& sample : stick.samples) sample.has_orientation = false;
    }
    EXPECT_LE(implausible(trace).size(), 1u);
}

}  // namespace
}  // namespace tracking
