#include "strikes/strike_forecast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "files/assets.h"

namespace {

using Eigen::Vector3d;

/// A stick without length above the middle of an instrument of the bundled drums.
class OverADrum : public testing::Test {
protected:
    OverADrum() : kit_(app::read_kit(app::find_kit("drums"))), bodies_(app::bodies_of(kit_)) {
        geometry_.tip = Vector3d::Zero();
        top_ = bodies_[0].world_from_body.translation();
        top_.y() += 2;
        for (int i = 0; i < 20; ++i)  // the head is level
            top_.y() -= sim::rest_distance(bodies_[0], top_, geometry_.radius_m).distance;
    }
    /// `height_m` over the head, where the tip touches it.
    [[nodiscard]] tracking::PoseSample over(double t_s, double height_m) const {
        return {t_s, top_ + Vector3d(0, height_m, 0)};
    }
    [[nodiscard]] std::optional<app::NextStrike> after(app::StrikeForecast& forecast,
                                                       tracking::Predictor& predictor, double t_s,
                                                       double height_m) const {
        return forecast.after(predictor, t_s, tracking::feed(predictor, over(t_s, height_m)));
    }

    app::Kit kit_;
    std::vector<sim::BodyDefinition> bodies_;
    app::StickGeometry geometry_;
    Vector3d top_;
};

TEST_F(OverADrum, AStickThatFallsSteadilyMeetsItWhenItGetsThere) {
    app::StrikeForecast forecast(geometry_, bodies_);
    const auto predictor = tracking::make_predictor("difference");
    std::optional<app::NextStrike> next;
    for (const double t : {0.0, 0.01, 0.02}) next = after(forecast, *predictor, t, 0.2 - 2 * t);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->body, 0u);
    // 0.16 m at 2 m/s. The head is flat to 0.5 mm within its middle: 0.25 ms; it is found to 0.1 ms.
    EXPECT_NEAR(next->in_s, 0.08, 0.0004);
    EXPECT_GT(next->probability, 0.9);
}

TEST_F(OverADrum, NothingIsSaidOfWhatIsOutOfReach) {
    app::StrikeForecast forecast(geometry_, bodies_);
    const auto predictor = tracking::make_predictor("difference");
    for (int i = 0; i < 5; ++i) EXPECT_EQ(after(forecast, *predictor, 0.01 * i, 3.0), std::nullopt);
}

TEST_F(OverADrum, ATipWithinItStrikesAgainOnlyOnceItHasLeft) {
    app::StrikeForecast forecast(geometry_, bodies_);
    const auto predictor = tracking::make_predictor("difference");
    for (int i = 0; i < 5; ++i) EXPECT_EQ(after(forecast, *predictor, 0.01 * i, -0.01), std::nullopt);
}

/// Swings of 2 Hz whose lowest point is over the head or in it, in turn; says whether it struck within the horizon.
struct Swings {
    double low_m, odd_low_m;
    [[nodiscard]] double height(double t) const {
        const double low = static_cast<int>(std::floor(2 * t)) % 2 == 0 ? low_m : odd_low_m;
        return low + 0.15 * (1 - std::cos(2 * std::numbers::pi * (2 * t - std::floor(2 * t) - 0.5)));
    }
    [[nodiscard]] bool strikes_within(double t, double horizon_s) const {
        for (double s = t; s < t + horizon_s; s += 0.001)
            if (height(s) > 0 && height(s + 0.001) <= 0) return true;
        return false;
    }
};

TEST_F(OverADrum, ProbabilitiesLearnWhatComesOfThem) {
    // Always struck, never struck (feints 20 mm over the head), every other time: with a predictor whose stated
    // covariances say nothing of that.
    for (const Swings& swings : {Swings{-0.02, -0.02}, {0.02, 0.02}, {-0.02, 0.02}}) {
        app::StrikeForecast forecast(geometry_, bodies_);
        const auto predictor = tracking::make_predictor("cv:q=1e7,decay=8");
        double said = 0, came = 0, squares = 0;
        int count = 0;
        constexpr double kSettlingS = 20, kEndS = 50;
        for (int i = 0; i / 60.0 < kEndS; ++i) {
            const double t = i / 60.0;
            const auto next = after(forecast, *predictor, t, swings.height(t));
            if (t < kSettlingS || !next) continue;
            const bool true_one = swings.strikes_within(t, app::kStrikeHorizonS);
            said += next->probability, came += true_one;
            squares += std::pow(next->probability - true_one, 2);
            ++count;
        }
        ASSERT_GT(count, 500);
        const double squares_of_base = came * (1 - came / count);
        // Of all that is said as much comes true; the wander of what is learned by 2 /s is some hundredths.
        EXPECT_NEAR(said / count, came / count, 0.05) << swings.low_m << ' ' << swings.odd_low_m;
        // And it tells one moment from another at least as well as its mean does.
        EXPECT_LT(squares, std::max(0.9 * squares_of_base, 0.01 * count))
            << swings.low_m << ' ' << swings.odd_low_m;
    }
}

}  // namespace
