#include "tracking/known_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "learned/model_of_random_weights.h"
#include "tracking/input.h"

namespace tracking {
namespace {

using Eigen::Vector3d;

const Vector3d kShaft = -Vector3d::UnitZ();

/// Those of a bundled trace, of one stick, until `end_s`.
std::vector<PoseSample> bundled(const std::string& name, double end_s = 5) {
    const Trace trace = read_trace(MUSICWORLD_SOURCE_DIR "/assets/traces/" + name);
    std::vector<PoseSample> samples;
    for (const PoseSample& sample : trace.sticks.front().samples)
        if (sample.t_s < end_s) samples.push_back(sample);
    return samples;
}

/// At 60 Hz for 5 s.
std::vector<PoseSample> moving(const std::function<Vector3d(double)>& position) {
    std::vector<PoseSample> samples;
    for (int i = 0; i < 300; ++i)
        samples.push_back({i / 60.0, position(i / 60.0), Eigen::Quaterniond::Identity(), true});
    return samples;
}

/// After how many seconds the motion is known for good; the last sample's time, and more, if it is not.
double known_after_s(const PathModel& model, const std::vector<PoseSample>& samples) {
    KnownMotion motion(model, kShaft);
    double since_s = samples.front().t_s;
    for (const PoseSample& sample : samples) {
        motion.push(sample);
        if (!motion.is_known()) since_s = sample.t_s + 1;
    }
    return since_s - samples.front().t_s - 1;
}

const PathModel& general() {
    static const PathModel model = read_path_model(MUSICWORLD_SOURCE_DIR "/assets/models/general.model");
    return model;
}

TEST(KnownMotion, IsWhatTheModelWasLearnedFrom) {
    for (const char* name : {"flourish.csv", "roll.csv", "feints.csv"})
        EXPECT_LT(known_after_s(general(), bundled(name)), 2) << name;
}

TEST(KnownMotion, OfSticksThatGoStraightOrSwaySlowlyIsNone) {
    const auto straight = moving([](double t) { return Vector3d(t, 1, 0); }),
               sways =
                   moving([](double t) { return Vector3d(0.4 * std::sin(2 * t), 1, 0.2 * std::cos(2 * t)); });
    for (const auto* samples : {&straight, &sways}) EXPECT_GE(known_after_s(general(), *samples), 4.9);
}

TEST(KnownMotion, OfAStickAtRestNothingIsKnown) {
    EXPECT_GE(known_after_s(general(),
                            moving([](double t) { return Vector3d(0, 1 + 1e-4 * std::sin(300 * t), 0); })),
              4.9);
}

TEST(KnownMotion, IsNotThatOfAModelThatKnowsNothing) {
    EXPECT_GE(known_after_s(model_of_random_weights(16, 3), bundled("roll.csv")), 4.9);
}

TEST(KnownMotion, SamplesThatComeTwiceMakeNothingKnown) {
    auto samples = moving([](double t) { return Vector3d(0.4 * std::sin(2 * t), 1, 0.2 * std::cos(2 * t)); });
    std::vector<PoseSample> twice;
    for (const PoseSample& sample : samples) {
        twice.push_back(sample);
        PoseSample again = sample;
        again.t_s += 1e-6;
        again.position.y() += 0.00025;
        twice.push_back(again);
    }
    EXPECT_GE(known_after_s(general(), twice), 4.9);
}

TEST(KnownMotion, OutlastsAGap) {
    KnownMotion motion(general(), kShaft);
    auto samples = bundled("roll.csv");
    for (const PoseSample& sample : samples) motion.push(sample);
    ASSERT_TRUE(motion.is_known());
    samples.front().t_s = samples.back().t_s + 20;
    motion.push(samples.front());
    EXPECT_TRUE(motion.is_known());
}

}  // namespace
}  // namespace tracking
