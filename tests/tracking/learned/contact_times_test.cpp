#include "tracking/contact_times.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "learned/contact_view.h"

namespace tracking {
namespace {

/// A contact for sure, spread evenly over the bins 4 to 7.
ContactTimes even() {
    ContactTimes times;
    for (std::size_t i = 0; i < times.before.size(); ++i)
        times.before[i] = std::clamp((static_cast<double>(i) - 4) / 4, 0.0, 1.0) * 0.8;
    return times;
}

TEST(ContactTimes, StateTheirProbabilityAndMedian) {
    const ContactTimes times = even();
    EXPECT_DOUBLE_EQ(times.probability(), 0.8);
    EXPECT_NEAR(times.median_s(), 6 * ContactTimes::kBinS, 1e-12);  // the middle of 4 to 8
    EXPECT_NEAR(times.probability_between(5 * ContactTimes::kBinS, 6.5 * ContactTimes::kBinS), 0.3, 1e-12);
    EXPECT_NEAR(times.reached_s(0.6), 7 * ContactTimes::kBinS, 1e-12);
    EXPECT_EQ(times.reached_s(0.9), std::numeric_limits<double>::infinity());
    EXPECT_DOUBLE_EQ(times.probability_between(-1, 1), 0.8);
    EXPECT_DOUBLE_EQ(ContactTimes().probability(), 0);
}

/// A plane that the tip is beneath is not looked at, nor one further than 0.25 s of its speed.
TEST(ContactTimes, PlanesAreInReachFromAboveWithinAQuarterOfASecond) {
    TipView tip;
    tip.speed = 2;
    const auto at = [&](double height_m) {
        tip.tip.y() = height_m;
        return in_reach(tip, Plane{});
    };
    EXPECT_TRUE(at(0.001));
    EXPECT_TRUE(at(0.49));
    EXPECT_FALSE(at(0.51));
    EXPECT_FALSE(at(-0.001));
}

/// What a network sees of a plane does not depend on where the kit stands and which way it faces.
TEST(ContactTimes, SeePlanesAlikeWhereverTheyAre) {
    const auto inputs_of = [](const Eigen::Quaterniond& yaw, const Eigen::Vector3d& shift) {
        TipHistory history(-Eigen::Vector3d::UnitZ(), {0, 0.1, -0.3});
        for (int i = 0; i < 30; ++i) {
            const double t = i / 60.0;
            PoseSample sample;
            sample.t_s = t;
            sample.position = yaw * Eigen::Vector3d(0.3 * t, 1 - t * t, 0.1 * t * t) + shift;
            sample.orientation = yaw * Eigen::Quaterniond(Eigen::AngleAxisd(t, Eigen::Vector3d::UnitX()));
            sample.has_orientation = true;
            history.push(sample);
        }
        TipView view;
        EXPECT_TRUE(history.look(view));
        ContactInputs inputs;
        const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 1, 0.1).normalized();
        look_at(view, {yaw * Eigen::Vector3d(0, 0.7, 0) + shift, yaw * normal}, inputs);
        return inputs;
    };
    const ContactInputs here = inputs_of(Eigen::Quaterniond::Identity(), {0, 0, 0});
    const Eigen::Quaterniond yaw(Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitY()));
    EXPECT_TRUE(here.isApprox(inputs_of(yaw, {30, 2, -7}), 1e-5F));  // floats
}

/// Sensors' quaternions are of length 1 within 1 %: the tip lies where their direction says.
TEST(ContactTimes, SeeTheTipWhereTheShaftEndsWhateverTheQuaternionsLength) {
    const auto tip_of = [](double length) {
        TipHistory history(-Eigen::Vector3d::UnitZ(), {0, 0.1, -0.3});
        for (int i = 0; i < 30; ++i) {
            PoseSample sample;
            sample.t_s = i / 60.0;
            sample.position = {0.3 * sample.t_s, 1, 0};
            sample.orientation = Eigen::AngleAxisd(sample.t_s, Eigen::Vector3d::UnitX());
            sample.orientation.coeffs() *= length;
            sample.has_orientation = true;
            history.push(sample);
        }
        TipView view;
        EXPECT_TRUE(history.look(view));
        return view.tip;
    };
    EXPECT_LT((tip_of(1.01) - tip_of(1)).norm(), 1e-12);  // 1 m in doubles
}

}  // namespace
}  // namespace tracking
