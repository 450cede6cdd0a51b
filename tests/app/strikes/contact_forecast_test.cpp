// Forecasts of a network whose answer is written by hand: the same whatever it sees.
#include "strikes/contact_forecast.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

using app::ContactForecast;
using Eigen::Vector3d;
using tracking::ContactTimes;

constexpr int kBin = 6;  // in which the contact comes, if there is one
constexpr double kContactS = (kBin + 0.5) * ContactTimes::kBinS;
constexpr double kForecastReachS = 1.0 / 15;

/// Says: a contact in that bin with probability `p`, else none.
std::shared_ptr<const tracking::PathModel> saying(double p) {
    constexpr int kInputs = tracking::TipView::kInputs + 3 + 2 + 13, kHidden = 4,
                  kOutputs = ContactTimes::kBins + 1;
    tracking::PathModel model;
    model.contacts.emplace();
    const int sizes[] = {kInputs, kHidden, kHidden, kOutputs};
    for (std::size_t i = 0; i < 3; ++i) {
        (*model.contacts)[i].weights.setZero(sizes[i + 1], sizes[i]);
        (*model.contacts)[i].bias.setZero(sizes[i + 1]);
    }
    Eigen::VectorXf& odds = (*model.contacts)[2].bias;
    odds.setConstant(-1000);
    odds[kBin] = static_cast<float>(std::log(p));
    odds[kOutputs - 1] = static_cast<float>(std::log(1 - p));
    return std::make_shared<const tracking::PathModel>(model);
}

/// A tip at `height_m` over the floor, which sinks at 1 m/s and moves along it at 0.5 m/s.
ContactForecast::Forecast forecast(double p, double height_m = 0.1, double reach_s = kForecastReachS) {
    tracking::TipView tip;
    tip.tip = {0, height_m, 0};
    tip.velocity = {0.5, -1, 0};
    sim::TipPath predicted;
    predicted.nodes = {{2, tip.tip, tip.velocity}, {2.1, tip.tip + 0.1 * tip.velocity, tip.velocity}};
    const ContactForecast::Surfaces floor{1, [](std::size_t, const Vector3d& x) {
                                              return sim::SurfacePoint{x.y(), Vector3d::UnitY()};
                                          }};
    return ContactForecast(saying(p)).after(tip, predicted, floor, reach_s);
}

std::optional<ContactForecast::Path> expected(double p, double height_m = 0.1,
                                              double reach_s = kForecastReachS) {
    return forecast(p, height_m, reach_s).strike;
}

TEST(ContactForecast, SaysNothingWhereNothingIsLikelyToBeStruck) {
    EXPECT_FALSE(expected(0));
    EXPECT_FALSE(expected(0.04)) << "less than 5 %";
    EXPECT_TRUE(expected(0.06));
    EXPECT_FALSE(expected(0.9, -0.01)) << "the tip is in the surface";
    EXPECT_FALSE(expected(0.9, 0.3)) << "0.3 s of its speed away";
    EXPECT_FALSE(expected(0.9, 0.1, 0.9 * kContactS)) << "later than is looked for";
    EXPECT_TRUE(expected(0.9));
}

TEST(ContactForecast, SaysOfEverySurfaceInReachWhenItIsMet) {
    const ContactForecast::Forecast unlikely = forecast(0.04);
    ASSERT_EQ(unlikely.times.size(), 1U);
    ASSERT_TRUE(unlikely.times[0]);
    EXPECT_NEAR(unlikely.times[0]->probability(), 0.04, 1e-6);  // floats
    EXPECT_FALSE(forecast(0.9, 0.3).times[0]) << "0.3 s of its speed away";
    EXPECT_TRUE(forecast(0.9, -0.01).times.empty()) << "the tip is in the surface";
}

TEST(ContactForecast, ItsPathMeetsThePlaneWhenTheNetworkSays) {
    const auto strike = expected(0.9);
    ASSERT_TRUE(strike);
    int at_contact = 0;
    for (const sim::PathNode& node : strike->path.nodes) {
        const double before_s = 2 + kContactS - node.t_s;
        if (std::abs(before_s) < 1e-6) {  // the median of float probabilities
            ++at_contact;
            EXPECT_NEAR(node.position.y(), 0, 1e-12);
        } else {
            EXPECT_EQ(node.position.y() > 0, before_s > 0) << before_s;
        }
        EXPECT_LT(node.velocity.y(), 0) << "it falls all the way";
        EXPECT_NEAR(node.position.x(), 0.5 * (node.t_s - 2), 1e-12) << "along the plane as predicted";
    }
    EXPECT_EQ(at_contact, 1);
}

}  // namespace
