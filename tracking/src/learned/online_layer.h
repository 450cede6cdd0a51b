#pragma once
#include <Eigen/Core>

#include "learned/network.h"
#include "tracking/experience.h"

namespace tracking {

/// The last layer of a network, learned while the player plays: ridge regression with exponential forgetting,
/// regularised towards the model's weights.
///
///   W = arg min  sum_i l_i |y_i - W x_i|^2 + d |W - W0|^2,   l_i = exp(-age_i / T) v_i^2 dt_i / (1/60 s)
///     = W0 + B (A + d I)^-1,   A = sum_i l_i x_i x_i^T,  B = sum_i l_i (y_i - W0 x_i) x_i^T
///
///   x  n      the second hidden layer's values, and 1
///   y  30     the true residuals (outputs `means` of the network), v the PathFrame's speed [m/s], so that
///             errors count in metres, and dt the time since the example before
///   W0 30 x n the model's last layer, d = kDraw: W stays near it with few examples, and returns to it when
///             there are no new ones
///
/// An example is learned once its longest lead has passed, so that all leads share A. A + d I is positive
/// definite for any input: d is some 1e7 times the rounding of A. n (n + 60) / 2 multiplications per example;
/// every kEvery examples, counted and not timed, n^3 / 6 + 30 n^2 for the solution. Allocates when it is made
/// only.
class OnlineLayer {
public:
    static constexpr double kDraw = 2;
    static constexpr int kEvery = 32;

    /// `memory_s`: T.
    OnlineLayer(const Network& network, double memory_s);

    /// Adds an example; true if W was solved anew. `known_shaft`: whether the residuals of directions count.
    bool learn(const Network::Hidden& hidden, const PathMeans& residuals, bool known_shaft, double speed,
               double dt_s) noexcept;
    [[nodiscard]] const Eigen::MatrixXf& weights() const noexcept { return weights_; }  ///< 30 x n, bias last
    /// Adds the sums of another stick with the same model; solve() then finds the W of both.
    void add(const Experience& other);
    [[nodiscard]] Experience experience() const { return {moments_, against_, {}}; }
    void solve() noexcept;

private:
    double memory_s_;
    int since_ = 0;
    Eigen::MatrixXd first_weights_, moments_, against_, matrix_, solution_;
    Eigen::VectorXd x_, error_;
    Eigen::MatrixXf weights_;
};

}  // namespace tracking
