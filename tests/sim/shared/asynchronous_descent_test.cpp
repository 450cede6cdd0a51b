// The thesis's argument for bounded asynchrony (2.3.2, 2.3.3), by numbers: descent on a potential energy by
// K micro-steps an interval dT, of all parameters at once or of one worker's after another's in any order,
// and by workers that see each other's parameters late.
//
//   (2.24)  mean of the K gradients met in an interval
//   (2.28)  its claimed value: (I - eta dT / 2 H) A, A gradient and H Hessian at the interval's start
//   (2.29)  the second-order rule: (I + rho H)^-1 A, rho = eta dT / 2; (2.30) its Taylor expansion
//
// Written out, (2.25)'s double sum has K (K - 1) / 2 terms, not K^2 / 2: at finite K the second-order term
// is (K - 1) / K of (2.28)'s.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kEta = 0.7;  // rate of descent; not 1, so that a lost factor shows

/// A lattice as in figure 2-9: 4 x 3 points in the plane joined by springs, hung up at its upper corners,
/// under gravity. Springs have a rest length, so the Hessian depends on the state.
class Lattice {
public:
    static constexpr int kColumns = 4, kRows = 3, kPoints = kColumns * kRows;

    Lattice() {
        for (int i = 0; i < kPoints; ++i) {
            if (i % kColumns + 1 < kColumns) springs_.push_back({i, i + 1});
            if (i + kColumns < kPoints) springs_.push_back({i, i + kColumns});
        }
    }
    [[nodiscard]] static VectorXd start() {
        VectorXd u(2 * kPoints);
        for (int i = 0; i < kPoints; ++i) {
            const int column = i % kColumns, row = i / kColumns;
            const double x = column, y = -row;
            u.segment<2>(2 * i) = Vector2d(x + 0.15 * std::sin(2.0 * i), y + 0.2 * std::cos(3.0 * i));
        }
        return u;
    }
    [[nodiscard]] VectorXd gradient(const VectorXd& u) const {
        VectorXd g = VectorXd::Zero(u.size());
        for (int i = 0; i < kPoints; ++i) g[2 * i + 1] = kWeight;
        for (const auto& [corner, place] : hooks())
            g.segment<2>(2 * corner) += u.segment<2>(2 * corner) - place;
        for (const auto& [a, b] : springs_) {
            const Vector2d d = u.segment<2>(2 * a) - u.segment<2>(2 * b);
            const Vector2d force = d * (1 - kRest / d.norm());
            g.segment<2>(2 * a) += force, g.segment<2>(2 * b) -= force;
        }
        return g;
    }
    [[nodiscard]] MatrixXd hessian(const VectorXd& u) const {
        MatrixXd h = MatrixXd::Zero(u.size(), u.size());
        for (const auto& [corner, place] : hooks()) h.block<2, 2>(2 * corner, 2 * corner).setIdentity();
        for (const auto& [a, b] : springs_) {
            const Vector2d d = u.segment<2>(2 * a) - u.segment<2>(2 * b), n = d.normalized();
            const Eigen::Matrix2d stiffness =
                Eigen::Matrix2d::Identity() -
                kRest / d.norm() * (Eigen::Matrix2d::Identity() - n * n.transpose());
            for (const auto& [p, q, sign] : {std::tuple{a, a, 1}, {b, b, 1}, {a, b, -1}, {b, a, -1}})
                h.block<2, 2>(2 * p, 2 * q) += sign * stiffness;
        }
        return h;
    }
    /// Which of `workers` simulates a parameter: columns of points go round.
    [[nodiscard]] static int owner(Eigen::Index parameter, int workers) {
        return static_cast<int>(parameter / 2) % kColumns % workers;
    }

private:
    static constexpr double kRest = 0.8, kWeight = 0.1;
    static std::vector<std::pair<int, Vector2d>> hooks() {
        return {{0, Vector2d(0, 0)}, {kColumns - 1, Vector2d(kColumns - 1, 0)}};
    }
    std::vector<std::pair<int, int>> springs_;
};

/// The parameters of one worker; the others zero.
VectorXd part_of(int worker, int workers, const VectorXd& all) {
    VectorXd part = VectorXd::Zero(all.size());
    for (Eigen::Index i = 0; i < all.size(); ++i)
        if (Lattice::owner(i, workers) == worker) part[i] = all[i];
    return part;
}

/// H without what joins parameters of different workers, or only that.
MatrixXd within_workers(const MatrixXd& hessian, int workers) {
    MatrixXd within = hessian;
    for (Eigen::Index i = 0; i < hessian.rows(); ++i)
        for (Eigen::Index j = 0; j < hessian.cols(); ++j)
            if (Lattice::owner(i, workers) != Lattice::owner(j, workers)) within(i, j) = 0;
    return within;
}

/// (2.16)-(2.19) and (2.24): the mean gradient over K micro-steps of dT / K.
VectorXd mean_gradient(const Lattice& lattice, VectorXd u, double interval, int micro_steps) {
    VectorXd sum = VectorXd::Zero(u.size());
    for (int l = 0; l < micro_steps; ++l) {
        const VectorXd gradient = lattice.gradient(u);
        sum += gradient;
        u -= kEta * interval / micro_steps * gradient;
    }
    return sum / micro_steps;
}

/// What an interval amounts to when workers step in this order, each its own parameters by `step`: the mean
/// gradient, -dU / (eta dT).
VectorXd mean_gradient_in_order(const Lattice& lattice, const VectorXd& start, double interval,
                                const std::vector<int>& order, int workers, double step) {
    VectorXd u = start;
    for (const int worker : order) u -= kEta * step * part_of(worker, workers, lattice.gradient(u));
    return (start - u) / (kEta * interval);
}

/// By how much an error falls when its cause is halved, as a power of two.
double order_of(const std::function<double(double)>& error, double at) {
    return std::log2(error(at) / error(0.5 * at));
}

class AsynchronousDescent : public testing::Test {
protected:
    Lattice lattice;
    VectorXd u = Lattice::start();
    VectorXd a = lattice.gradient(u);
    MatrixXd h = lattice.hessian(u);
};

TEST_F(AsynchronousDescent, TheLatticesHessianIsItsGradientsDerivative) {
    const double step = 1e-6;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
        VectorXd up = u, down = u;
        up[i] += step, down[i] -= step;
        const VectorXd column = (lattice.gradient(up) - lattice.gradient(down)) / (2 * step);
        EXPECT_LT((column - h.col(i)).norm(), 1e-8);  // central differences: step^2 and rounding / step
    }
    EXPECT_GT((lattice.hessian(u + 0.1 * a) - h).norm(), 0.1);  // it does depend on the state
}

TEST_F(AsynchronousDescent, TheMeanGradientIsTheSecondOrderRuleUpToTheSquareOfTheInterval) {
    // Many micro-steps, so that what is left is the interval's: (2.28)'s error, of order dT^2.
    const auto error = [&](double interval) {
        return (mean_gradient(lattice, u, interval, 1 << 14) - (a - 0.5 * kEta * interval * (h * a))).norm();
    };
    EXPECT_NEAR(order_of(error, 0.04), 2, 0.1);
    // Without its second-order term the rule is one order worse: the term is what asynchrony adds.
    const auto without = [&](double interval) {
        return (mean_gradient(lattice, u, interval, 1 << 14) - a).norm();
    };
    EXPECT_NEAR(order_of(without, 0.04), 1, 0.05);
}

TEST_F(AsynchronousDescent, AtFiniteKTheSecondOrderTermIsKMinus1OverKOfTheLimits) {
    const VectorXd term = 0.5 * kEta * (h * a);
    for (const int k : {1, 2, 3, 5, 10, 100}) {
        // Of the term, what is there as the interval goes to zero; its next order is extrapolated away.
        const auto share = [&](double interval) {
            return (a - mean_gradient(lattice, u, interval, k)).dot(term) / (interval * term.squaredNorm());
        };
        EXPECT_NEAR(2 * share(1e-4) - share(2e-4), (k - 1.0) / k, 1e-6) << k;
        const auto error = [&](double interval) {
            return (mean_gradient(lattice, u, interval, k) - (a - (k - 1.0) / k * interval * term)).norm();
        };
        if (k == 1) continue;  // exact: one gradient
        EXPECT_NEAR(order_of(error, 0.02), 2, 0.1) << k;
    }
}

TEST_F(AsynchronousDescent, TheImplicitRuleAndItsExpansionDifferByASixthAndAQuarterOfTheSquare) {
    // On the quadratic with this Hessian the mean is (1 - e^-x) / x = 1 - x/2 + x^2/6 - ..., x = eta dT H;
    // (2.29) is 1 - x/2 + x^2/4 - ..., (2.30) 1 - x/2.
    const double interval = 1e-3;
    const MatrixXd x = kEta * interval * h, one = MatrixXd::Identity(h.rows(), h.cols());
    const VectorXd square = x * (x * a), mean = a - 0.5 * x * a + square / 6 - x * square / 24;
    const VectorXd implicit = (one + 0.5 * x).partialPivLu().solve(a), expanded = a - 0.5 * x * a;
    const auto share = [&](const VectorXd& difference) {
        return difference.dot(square) / square.squaredNorm();
    };
    const double next = 2 * x.norm();  // relative size of the next term
    EXPECT_NEAR(share(implicit - mean), 1.0 / 4 - 1.0 / 6, next / 12);
    EXPECT_NEAR(share(mean - expanded), 1.0 / 6, next / 24);
    // And on the lattice itself (2.29) is as near as (2.28): order dT^2.
    const auto error = [&](double dt) {
        const MatrixXd stabilised = one + 0.5 * kEta * dt * h;
        return (mean_gradient(lattice, u, dt, 1 << 14) - stabilised.partialPivLu().solve(a)).norm();
    };
    EXPECT_NEAR(order_of(error, 0.04), 2, 0.1);
}

TEST_F(AsynchronousDescent,
       OverAllOrdersOfThreeWorkersEachOnceTheTermBetweenThemIsWholeAndTheirOwnIsMissing) {
    // Each worker steps once by dT. Another is ahead of it in half of the orders: half of what joins them,
    // as (2.28) says; none of its own, (K - 1) / K with K = 1.
    constexpr int kWorkers = 3;
    const auto mean = [&](double interval) {
        std::vector<int> order(kWorkers);
        std::iota(order.begin(), order.end(), 0);
        VectorXd sum = VectorXd::Zero(u.size());
        int count = 0;
        do {
            sum += mean_gradient_in_order(lattice, u, interval, order, kWorkers, interval);
            ++count;
        } while (std::next_permutation(order.begin(), order.end()));
        return VectorXd(sum / count);
    };
    const MatrixXd between = h - within_workers(h, kWorkers);
    const auto error = [&](double interval) {
        return (mean(interval) - (a - 0.5 * kEta * interval * (between * a))).norm();
    };
    EXPECT_NEAR(order_of(error, 0.02), 2, 0.1);
    const auto whole = [&](double interval) {
        return (mean(interval) - (a - 0.5 * kEta * interval * (h * a))).norm();
    };
    EXPECT_NEAR(order_of(whole, 0.02), 1, 0.1);
}

TEST_F(AsynchronousDescent, OverAllOrdersOfWorkersThatStepMTimesTheirOwnTermIsMMinus1OverM) {
    for (const auto& [workers, times] : {std::pair{3, 2}, {2, 4}, {3, 3}}) {
        const auto error = [&, workers = workers, times = times](double interval) {
            std::vector<int> order;
            for (int i = 0; i < workers * times; ++i) order.push_back(i / times);
            VectorXd sum = VectorXd::Zero(u.size());
            int count = 0;
            do {
                sum += mean_gradient_in_order(lattice, u, interval, order, workers, interval / times);
                ++count;
            } while (std::next_permutation(order.begin(), order.end()));
            const MatrixXd own = within_workers(h, workers);
            const MatrixXd met = h - own + (times - 1.0) / times * own;
            return (sum / count - (a - 0.5 * kEta * interval * (met * a))).norm();
        };
        EXPECT_NEAR(order_of(error, 0.02), 2, 0.1) << workers << " workers, " << times << " times";
    }
}

TEST_F(AsynchronousDescent, AWorkerDrawnForEachMicroStepGivesOnAverageTheSynchronousMicroSteps) {
    // Drawn anew each time and stepping N times as far, a worker's step is unbiased: over all N^K sequences
    // the average is that of micro-steps of all parameters, (K - 1) / K of the term everywhere; on a
    // quadratic to rounding.
    constexpr int kWorkers = 3, kMicro = 5, kSequences = 243;
    const auto mean = [&](double interval) {
        VectorXd sum = VectorXd::Zero(u.size());
        for (int number = 0; number < kSequences; ++number) {
            std::vector<int> order;
            for (int i = 0, rest = number; i < kMicro; ++i, rest /= kWorkers)
                order.push_back(rest % kWorkers);
            sum +=
                mean_gradient_in_order(lattice, u, interval, order, kWorkers, kWorkers * interval / kMicro);
        }
        return VectorXd(sum / kSequences);
    };
    const auto error = [&](double interval) {
        return (mean(interval) - (a - (kMicro - 1.0) / kMicro * 0.5 * kEta * interval * (h * a))).norm();
    };
    EXPECT_NEAR(order_of(error, 0.01), 2, 0.1);
    const auto beside = [&](double interval) {
        return (mean(interval) - mean_gradient(lattice, u, interval, kMicro)).norm();
    };
    EXPECT_NEAR(order_of(beside, 0.01), 2, 0.1);  // the lattice's third derivatives meet the steps' spread
}

/// Descent by workers that know their own parameters and others' as they were `age(step)` steps ago; with
/// `extrapolated`, moved on at the pace they had.
class LateDescent {
public:
    LateDescent(const Lattice& lattice, const VectorXd& start, double step, int workers, bool extrapolated)
        : lattice_(lattice), past_{start}, step_(step), workers_(workers), extrapolated_(extrapolated) {}

    void advance(int steps, const std::function<int()>& age) {
        for (int i = 0; i < steps; ++i) {
            VectorXd next = past_.back();
            for (int worker = 0; worker < workers_; ++worker)
                next -= kEta * step_ * part_of(worker, workers_, lattice_.gradient(seen_by(worker, age())));
            past_.push_back(next);
            if (past_.size() > 64) past_.pop_front();
        }
    }
    [[nodiscard]] const VectorXd& now() const { return past_.back(); }

private:
    [[nodiscard]] VectorXd seen_by(int worker, int age) const {
        const std::size_t last = past_.size() - 1, at = last - std::min<std::size_t>(last, std::size_t(age));
        VectorXd ghost = past_[at];
        if (extrapolated_ && at > 0) ghost += double(last - at) * (past_[at] - past_[at - 1]);
        return ghost + part_of(worker, workers_, past_.back() - ghost);
    }

    const Lattice& lattice_;
    std::deque<VectorXd> past_;
    double step_;
    int workers_;
    bool extrapolated_;
};

TEST_F(AsynchronousDescent, TheRestStateIsTheSameForAnyBound) {
    // Where the gradient is zero nothing moves, however old what the workers see: the rest state is the
    // energy's minimum for each B, and only the way there differs.
    LateDescent lockstep(lattice, u, 0.1, 4, false);
    lockstep.advance(20000, [] { return 0; });
    ASSERT_LT(lattice.gradient(lockstep.now()).norm(), 1e-12);
    ASSERT_GT(lattice.hessian(lockstep.now()).selfadjointView<Eigen::Lower>().eigenvalues()[0], 1e-3);
    for (const int bound : {1, 4, 16}) {
        std::mt19937 random(7);
        LateDescent late(lattice, u, 0.1, 4, false);
        late.advance(20000, [&] { return int(random() % std::uint32_t(bound + 1)); });
        EXPECT_LT((late.now() - lockstep.now()).norm(), 1e-10) << bound;
    }
}

TEST_F(AsynchronousDescent, OnTheWayTheErrorGrowsWithBAndWithItsSquareWhenGhostsAreExtrapolated) {
    const double step = 1e-3;
    const auto apart = [&](int bound, bool extrapolated) {
        LateDescent lockstep(lattice, u, step, 4, false), late(lattice, u, step, 4, extrapolated);
        double most = 0;
        for (int i = 0; i < 1500; ++i) {
            lockstep.advance(1, [] { return 0; });
            late.advance(1, [&] { return i < 64 ? 0 : bound; });  // a past first
            most = std::max(most, (late.now() - lockstep.now()).norm());
        }
        return most;
    };
    EXPECT_NEAR(apart(8, false) / apart(4, false), 2, 0.1);
    EXPECT_NEAR(apart(16, false) / apart(8, false), 2, 0.1);
    // An age of B steps at a pace that is half a step older still: B (B + 1) / 2 second differences.
    EXPECT_NEAR(apart(16, true) / apart(8, true), 16.0 * 17 / (8 * 9), 0.2);
    EXPECT_LT(apart(16, true), 0.05 * apart(16, false));
}

TEST(LateGradient, AStepThatIsStableInLockstepIsNoLongerSoBeyond2CosOfBPiOver2BPlus1) {
    // x(n+1) = x(n) - s x(n-B): stable if and only if s < 2 cos(B pi / (2B + 1)) (Levin and May 1976), which
    // is 2 at B = 0 and falls as pi / (2B + 1): what bounds B is the stiffest force across workers.
    for (const int bound : {0, 1, 4, 16}) {
        const double limit = 2 * std::cos(bound * M_PI / (2 * bound + 1));
        const auto size_after = [&](double s) {
            std::deque<double> x(std::size_t(bound) + 1, 1.0);
            double last = 0;
            for (int n = 0; n < 40000; ++n) {
                x.push_back(x.back() - s * x.front());
                x.pop_front();
                if (n >= 39000) last = std::max(last, std::abs(x.back()));
                if (std::abs(x.back()) > 1e6) return 1e6;
            }
            return last;
        };
        EXPECT_LT(size_after(0.98 * limit), 1e-3) << bound;
        EXPECT_GE(size_after(1.02 * limit), 1e6) << bound;
    }
}

}  // namespace
