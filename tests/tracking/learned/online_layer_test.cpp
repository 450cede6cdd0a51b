// Learning while playing: the regression, its forgetting, what is saved of it.
#include "learned/online_layer.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "learned/learned_path.h"
#include "learned/model_of_random_weights.h"

namespace tracking {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

struct Example {
    Network::Hidden hidden;
    PathMeans residuals;
    double speed, dt_s;
};

std::vector<Example> random_examples(Eigen::Index units, int count, std::uint64_t seed) {
    RandomStream random(seed);
    std::vector<Example> examples(static_cast<std::size_t>(count));
    for (Example& e : examples) {
        e.hidden.setZero(units);
        for (float& x : e.hidden) x = static_cast<float>(random.normal());
        for (float& y : e.residuals) y = static_cast<float>(0.1 * random.normal());
        e.speed = 0.5 + 2 * random.uniform();
        e.dt_s = 0.005 + 0.02 * random.uniform();
    }
    return examples;
}

TEST(OnlineLayer, IsTheWeightedRidgeRegressionOfItsDefinition) {
    const PathModel model = model_of_random_weights(12, 3);
    const Network network(model);
    constexpr double kMemory = 2;
    OnlineLayer layer(network, kMemory);
    const std::vector<Example> examples = random_examples(12, 160, 5);
    MatrixXd a = OnlineLayer::kDraw * MatrixXd::Identity(13, 13), b = MatrixXd::Zero(30, 13), w0(30, 13);
    w0 << network.mean_weights().cast<double>(), network.mean_bias().cast<double>();
    double age_s = 0;
    for (auto e = examples.rbegin(); e != examples.rend(); ++e) {  // the newest first
        VectorXd x(13);
        x << e->hidden.cast<double>(), 1;
        const double weight = std::exp(-age_s / kMemory) * e->speed * e->speed * e->dt_s * 60;
        a += weight * x * x.transpose();
        b += weight * (e->residuals.cast<double>() - w0 * x) * x.transpose();
        age_s += e->dt_s;
    }
    bool newest = false;
    for (const Example& e : examples) newest = layer.learn(e.hidden, e.residuals, true, e.speed, e.dt_s);
    ASSERT_TRUE(newest) << "160 is a multiple of kEvery";
    const MatrixXd right = w0 + b * a.llt().solve(MatrixXd::Identity(13, 13));
    // Doubles, handed on as floats of order 0.1.
    EXPECT_LT((layer.weights().cast<double>() - right).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(OnlineLayer, StaysFiniteWhateverComes) {
    const Network network(model_of_random_weights(8, 3));
    OnlineLayer layer(network, 1);
    Network::Hidden hidden = Network::Hidden::Constant(8, 1e4F);  // always the same: A has rank one
    PathMeans residuals = PathMeans::Constant(1e30F);
    for (int i = 0; i < 100000; ++i) {
        if (i % 1000 == 0) hidden *= -1e-3F, residuals *= -1;
        (void)layer.learn(hidden, residuals, true, i % 7 == 0 ? 1e9 : 1e-9, i % 100 == 0 ? 0.1 : 1e-3);
        ASSERT_TRUE(layer.weights().allFinite()) << i;
    }
}

TEST(OnlineLayer, ReturnsToTheModelWhenNothingNewComes) {
    const Network network(model_of_random_weights(8, 3));
    OnlineLayer layer(network, 0.5);
    const MatrixXd first = layer.weights().cast<double>();
    for (const Example& e : random_examples(8, 64, 2))
        (void)layer.learn(e.hidden, PathMeans::Constant(0.5F), true, e.speed, e.dt_s);
    EXPECT_GT((layer.weights().cast<double>() - first).norm(), 0.1);
    for (int i = 0; i < 1600; ++i)  // at rest: 16 s, 32 memories
        (void)layer.learn(Network::Hidden::Zero(8), PathMeans::Zero(), true, 1e-6, 0.01);
    EXPECT_LT((layer.weights().cast<double>() - first).norm(), 1e-6);
}

TEST(OnlineLayer, TeachesNothingOfAShaftThatIsNotKnown) {
    const Network network(model_of_random_weights(8, 3));
    OnlineLayer layer(network, 10);
    const Eigen::MatrixXf first = layer.weights();
    for (const Example& e : random_examples(8, 64, 2))
        (void)layer.learn(e.hidden, PathMeans::Constant(0.5F), false, e.speed, e.dt_s);
    for (Eigen::Index l = 0; l < 5; ++l) {
        EXPECT_GT((layer.weights() - first).middleRows(6 * l, 3).norm(), 0.1F);
        EXPECT_EQ((layer.weights() - first).middleRows(6 * l + 3, 3).norm(), 0.0F);
    }
}

PoseSample stroke(double t) {
    return {t, Vector3d(0.1 * std::sin(5 * t), 0.4 * std::abs(std::sin(8 * t)), 0.2 * std::cos(8 * t))};
}

/// RMS 1/15 s ahead over the last third of 40 s [m].
double rms_of(Predictor& predictor, double rate_hz) {
    double sum = 0;
    int count = 0;
    for (int i = 0; i < 40 * rate_hz; ++i) {
        const double t = i / rate_hz;
        (void)predictor.correct(stroke(t));
        if (3 * i < 80 * rate_hz) continue;
        sum += (predictor.predict(1.0 / 15).position - stroke(t + 1.0 / 15).position).squaredNorm();
        ++count;
    }
    return std::sqrt(sum / count);
}

TEST(Learned, GetsBetterWhileItPlaysAtAnyRate) {
    const PathModel model = model_of_random_weights(48, 7);
    for (const double rate_hz : {30.0, 60.0, 240.0, 1000.0}) {
        Learned still(model, Vector3d::UnitY()), online(model, Vector3d::UnitY(), 100);
        EXPECT_LT(rms_of(online, rate_hz), 0.5 * rms_of(still, rate_hz)) << rate_hz;
    }
}

/// A clock may begin anywhere, below zero, too.
TEST(Learned, LearnsTheSameWheneverATraceBegins) {
    const PathModel model = model_of_random_weights(48, 7);
    const auto played_from = [&](double t0_s) {
        Learned online(model, Vector3d::UnitY(), 100);
        std::vector<Vector3d> predicted;
        for (int i = 0; i < 1200; ++i) {
            PoseSample sample = stroke(i / 57.0);  // no lead or age is a whole number of periods
            sample.t_s += t0_s;
            (void)online.correct(sample);
            predicted.push_back(online.predict(1.0 / 15).position);
        }
        return predicted;
    };
    const std::vector<Vector3d> here = played_from(0), before = played_from(-100), after = played_from(100);
    double farthest = 0;
    for (std::size_t i = 0; i < here.size(); ++i)
        farthest = std::max({farthest, (here[i] - before[i]).norm(), (here[i] - after[i]).norm()});
    // Times of 100 s are rounded to 1.4e-14 s, the network's floats to 1e-7 of its answers of some 0.1 m;
    // what the last layer learns of such differences is regularised. Nothing learned: centimetres.
    EXPECT_LT(farthest, 1e-5);
}

TEST(Learned, WhatSticksTaughtIsAModelThatGoesOnWhereTheyEnded) {
    PathModel model = model_of_random_weights(48, 7);
    model.contacts = model.layers;  // any weights: what is learned of paths leaves them as they are
    std::vector<Experience> experiences;
    for (int stick = 0; stick < 2; ++stick) {
        Learned online(model, Vector3d::UnitY(), 100);
        (void)rms_of(online, 60);
        experiences.push_back(experience_of(online).value());
    }
    const PathModel better = taught(model, experiences);
    Learned before(model, Vector3d::UnitY()), after(better, Vector3d::UnitY());
    EXPECT_LT(rms_of(after, 60), 0.5 * rms_of(before, 60));
    EXPECT_EQ(better.layers[0].weights, model.layers[0].weights);
    EXPECT_EQ(better.layers[2].weights.bottomRows(kPathSpreads),
              model.layers[2].weights.bottomRows(kPathSpreads));
    ASSERT_TRUE(better.contacts.has_value());
    EXPECT_EQ((*better.contacts)[1].weights, model.layers[1].weights);
    EXPECT_FALSE(experience_of(before).has_value());
    EXPECT_THROW((void)taught(model_of_random_weights(8, 1), experiences), std::invalid_argument);
    PathModel alone = better;
    alone.contacts.reset();  // those above have not the size that files demand
    EXPECT_EQ(parse_path_model(format_path_model(alone), "b").layers[2].weights, better.layers[2].weights);
}

}  // namespace
}  // namespace tracking
