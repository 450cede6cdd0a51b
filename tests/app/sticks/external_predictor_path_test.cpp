#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include "sticks/external_predictor.h"

namespace {

using app::AnswerForm;
using app::AnswerPath;
using Eigen::Quaterniond;
using Eigen::Vector3d;

std::string message_of(const std::function<void()>& f) {
    try {
        f();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "nothing thrown";
}

TEST(AnswerForm, IsPositionAndWhatFollowsInItsOrder) {
    EXPECT_EQ(app::parse_answer_form("position").numbers(), 3U);
    EXPECT_EQ(app::parse_answer_form(" position  orientation\r").numbers(), 7U);
    EXPECT_EQ(app::parse_answer_form("position velocity orientation covariance").numbers(), 16U);
    for (const char* wrong :
         {"", "orientation", "position orientation velocity", "position position", "1 2 3"})
        EXPECT_NE(message_of([&] { (void)app::parse_answer_form(wrong); }).find("found \""),
                  std::string::npos)
            << wrong;
}

TEST(AnswerPath, IsTheAnswerAtItsLeadsAndExactForConstantAccelerationBetween) {
    const std::vector<double> leads = {0, 0.01, 0.025, 0.05, 0.07};
    AnswerPath path(leads, AnswerForm{});
    const Vector3d p(1, -2, 0.5), v(3, 8, -1), a(-40, 200, 9);
    const auto at = [&](double h) { return Vector3d(p + h * v + 0.5 * h * h * a); };
    std::vector<double> numbers;
    for (const double h : leads)
        for (int i = 0; i < 3; ++i) numbers.push_back(at(h)[i]);
    path.take({}, numbers);
    for (const double h : leads) EXPECT_EQ(path.at(h).position, at(h));
    // Rounding of positions near 1 m, over steps of 10 ms for velocities.
    for (double h = 0; h < 0.07; h += 0.0007) {
        EXPECT_LT((path.at(h).position - at(h)).norm(), 1e-14) << h;
        EXPECT_LT((path.at(h).velocity - (v + h * a)).norm(), 1e-12) << h;
    }
    const double beyond = 0.02;  // goes on with the last velocity
    EXPECT_LT((path.at(0.07 + beyond).position - at(0.07) - beyond * (v + 0.07 * a)).norm(), 1e-13);
}

TEST(AnswerPath, VelocityIsTheDerivativeOfThePathWhateverWasAnswered) {
    std::mt19937 random(1);
    const auto number = [&] { return static_cast<double>(random() % 2001) / 1000 - 1; };
    for (const bool velocity : {false, true}) {
        AnswerForm form;
        form.velocity = velocity;
        const std::vector<double> leads = {0.01, 0.02, 0.04};
        AnswerPath path(leads, form);
        std::vector<double> numbers(leads.size() * form.numbers());
        for (double& n : numbers) n = 0.1 * number();
        path.take({}, numbers);
        constexpr double kSmall = 1e-6;
        for (const double h : {0.003, 0.0125, 0.019, 0.031, 0.06}) {
            const Vector3d slope =
                (path.at(h + kSmall).position - path.at(h - kSmall).position) / (2 * kSmall);
            // Rounding 1e-17/1e-6, third derivative about 0.1/0.01^3 times 1e-12.
            EXPECT_LT((path.at(h).velocity - slope).norm(), 1e-6) << h;
        }
        if (velocity) {
            EXPECT_EQ(path.at(0.02).velocity, Vector3d(numbers[9], numbers[10], numbers[11]));
        }
    }
}

TEST(AnswerPath, StartsAtTheSampleWhereLeadZeroWasNotAsked) {
    const std::vector<double> leads = {0.1};
    AnswerPath path(leads, AnswerForm{});
    tracking::PosePrediction sample;
    sample.position = Vector3d(1, 0, 0);
    sample.orientation = Quaterniond(Eigen::AngleAxisd(1, Vector3d::UnitX()));
    path.take(sample, std::vector<double>{2, 0, 0});
    EXPECT_EQ(path.at(0).position, Vector3d(1, 0, 0));
    EXPECT_LT((path.at(0.05).position - Vector3d(1.5, 0, 0)).norm(), 1e-15);
    EXPECT_LT((path.at(0.05).velocity - Vector3d(10, 0, 0)).norm(), 1e-13);
    EXPECT_EQ(path.at(0.1).position, Vector3d(2, 0, 0));
    EXPECT_EQ(path.at(0.1).orientation.coeffs(), sample.orientation.coeffs());  // not answered: as sampled
}

TEST(AnswerPath, TurnsAtAConstantRateBetweenOrientationsWhateverTheirSigns) {
    AnswerForm form;
    form.orientation = true;
    const std::vector<double> leads = {0, 0.02, 0.05};
    AnswerPath path(leads, form);
    const Vector3d rate(3, -20, 7);  // rad/s
    const auto at = [&](double h) {
        return Quaterniond(Eigen::AngleAxisd(h * rate.norm(), rate.normalized())) *
               Quaterniond(Eigen::AngleAxisd(1, Vector3d::UnitZ()));
    };
    std::vector<double> numbers;
    double sign = 1;
    for (const double h : leads) {
        const Quaterniond q = at(h);
        for (const double n : {0.0, 0.0, 0.0, sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z()})
            numbers.push_back(n);
        sign = -sign;
    }
    path.take({}, numbers);
    for (const double h : {0.0, 0.004, 0.02, 0.033, 0.05, 0.08}) {
        EXPECT_LT(path.at(h).orientation.angularDistance(at(h)), 1e-7) << h;  // acos(1 - 1e-16)
        EXPECT_LT((path.at(h).angular_velocity - rate).norm(), 1e-12) << h;
    }
}

TEST(AnswerPath, CovariancesAreLinearBetweenAndRefusedWhenNegative) {
    AnswerForm form;
    form.covariance = true;
    const std::vector<double> leads = {0.01, 0.03};
    AnswerPath path(leads, form);
    EXPECT_FALSE(path.covariance_at(0.01).has_value());
    path.take({}, std::vector<double>{0, 0, 0, 1, 0.5, 0, 1, 0, 1, 0, 0, 0, 3, 0.5, 0, 1, 0, 1});
    EXPECT_EQ(path.covariance_at(0.01)->position(0, 0), 1);
    EXPECT_NEAR(path.covariance_at(0.02)->position(0, 0), 2, 1e-14);
    EXPECT_EQ(path.covariance_at(0.02)->position(1, 0), 0.5);
    EXPECT_EQ(path.covariance_at(0.2)->position(0, 0), 3);
    const std::vector<double> negative = {0, 0, 0, 1, 2, 0, 1, 0, 1, 9, 9, 9, 1, 0, 0, 1, 0, 1};
    EXPECT_NE(message_of([&] { path.take({}, negative); }).find("negative variance at lead 0.01 s"),
              std::string::npos);
    EXPECT_EQ(path.at(0.03).position, Vector3d::Zero()) << "a refused answer changes nothing";
}

TEST(AnswerPath, RefusesPlacesAndQuaternionsThatCannotBe) {
    AnswerForm form;
    form.orientation = true;
    const std::vector<double> leads = {0.05};
    AnswerPath path(leads, form);
    const auto refused = [&](std::vector<double> numbers) {
        return message_of([&] { path.take({}, numbers); });
    };
    EXPECT_NE(refused({1e7, 0, 0, 1, 0, 0, 0}).find("a position 10000000 m away"), std::string::npos);
    EXPECT_NE(refused({1e300, 1e300, 0, 1, 0, 0, 0}).find("a position inf m away"), std::string::npos);
    EXPECT_NE(refused({0, 0, 0, 0, 0, 0, 0}).find("norm 0"), std::string::npos);
    EXPECT_NE(refused({0, 0, 0, 2, 0, 0, 0}).find("norm 2"), std::string::npos);
    EXPECT_EQ(refused({0, 0, 0, -1.001, 0, 0, 0}), "nothing thrown");
}

}  // namespace
