// Bounded pace on a stack that two owners cut, by numbers: unit masses on the ground or in the air, contacts that hold them
// together, velocities alone. In a step each owner solves the contacts of its bodies and the one across against a
// ghost, which moves with the impulse by which the other owner's bodies held it before; what both find across is averaged
// (SharedContacts). So an error of velocities and impulses goes from step to step by a matrix, whose largest eigenvalue says
// whether the stack comes to rest.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

#include "shared/foreign_bodies.h"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class CutStack {
public:
    /// The lower owner has `cut` of the bodies. weight: of a step's impulse in the mean that holds the ghosts.
    CutStack(int bodies, int cut, bool ground, double weight)
        : n_(bodies), cut_(cut), ground_(ground), weight_(weight) {}

    /// velocities; mean impulses on the upper body of the contact across, and on the lower one, by their owners' other ones.
    [[nodiscard]] VectorXd step(const VectorXd& state, double gravity = 0) const {
        const double fall = -gravity;
        VectorXd below = state.head(cut_ + 1), above = state.segment(cut_ - 1, n_ - cut_ + 1);
        below.array() += fall, above.array() += fall;
        below[cut_] += state[n_], above[0] += state[n_ + 1];
        const VectorXd by_lower = solve(below, ground_), by_upper = solve(above, false);
        VectorXd next = VectorXd::Zero(n_ + 2);
        next.head(cut_) = below.head(cut_), next.segment(cut_, n_ - cut_) = above.tail(n_ - cut_);
        // Each body gets half of the difference: the lower one felt the contact by its owner, the upper one by its own.
        const double half = (by_upper[0] - by_lower[by_lower.size() - 1]) / 2;
        next[cut_ - 1] -= half, next[cut_] -= half;
        const double on_upper = by_upper.size() > 1 ? -by_upper[1] : 0,
                     on_lower = by_lower.size() > 1 ? by_lower[by_lower.size() - 2] : 0;
        next[n_] = state[n_] + weight_ * (on_upper - state[n_]);
        next[n_ + 1] = state[n_ + 1] + weight_ * (on_lower - state[n_ + 1]);
        return next;
    }
    /// Sizes of the eigenvalues, the largest first.
    [[nodiscard]] VectorXd eigenvalues() const {
        MatrixXd matrix(n_ + 2, n_ + 2);
        for (int i = 0; i < n_ + 2; ++i) matrix.col(i) = step(VectorXd::Unit(n_ + 2, i));
        VectorXd sizes = matrix.eigenvalues().cwiseAbs();
        std::sort(sizes.data(), sizes.data() + sizes.size(), std::greater());
        return sizes;
    }

private:
    /// Contacts of neighbours, and of the lowest with the ground; returns their impulses from below.
    static VectorXd solve(VectorXd& v, bool ground) {
        const Eigen::Index bodies = v.size(), contacts = bodies - 1 + ground;
        MatrixXd rows = MatrixXd::Zero(contacts, bodies);
        for (Eigen::Index c = 0; c < contacts; ++c) {
            const Eigen::Index upper = ground ? c : c + 1;
            rows(c, upper) = 1;
            if (upper > 0) rows(c, upper - 1) = -1;
        }
        const VectorXd impulses = (rows * rows.transpose()).ldlt().solve(-rows * v);
        v += rows.transpose() * impulses;
        return impulses;
    }
    int n_, cut_;
    bool ground_;
    double weight_;
};

constexpr double kMean = 1.0 / sim::kHeldSteps, kLastStep = 1;

}  // namespace

TEST(SharedStack, RestIsAFixedPointWhereverItIsCut) {
    for (const int n : {2, 5, 10})
        for (int cut = 1; cut < n; ++cut) {
            // At rest a contact carries the weight of what is above it: 1 each.
            VectorXd rest = VectorXd::Zero(n + 2);
            rest[n] = -(n - cut - 1.0), rest[n + 1] = n - cut + 1.0;
            EXPECT_LT((CutStack(n, cut, true, kMean).step(rest, 1) - rest).norm(), 1e-12) << n << " " << cut;
        }
}

TEST(SharedStack, MomentumIsKeptInTheAir) {
    for (const int n : {2, 5, 10})
        for (int cut = 1; cut < n; ++cut) {
            VectorXd state = VectorXd::Zero(n + 2);
            for (int i = 0; i < n + 2; ++i) state[i] = std::sin(3.0 * i + 1);
            const VectorXd next = CutStack(n, cut, false, kMean).step(state);
            EXPECT_NEAR(next.head(n).sum(), state.head(n).sum(), 1e-12) << n << " " << cut;
        }
}

TEST(SharedStack, ComesToRestWithGhostsHeldByTheMeanOfManySteps) {
    for (const int n : {2, 3, 5, 10, 20})
        for (int cut = 1; cut < n; ++cut) {
            EXPECT_LT(CutStack(n, cut, true, kMean).eigenvalues()[0], 1) << n << " " << cut;
            // In the air all may move together; what they do against each other ends.
            const VectorXd free = CutStack(n, cut, false, kMean).eigenvalues();
            EXPECT_NEAR(free[0], 1, 1e-9) << n << " " << cut;
            EXPECT_LT(free[1], 1) << n << " " << cut;
        }
}

TEST(SharedStack, IsSwungUpByGhostsThatAreHeldByTheLastStepsImpulses) {
    for (const int n : {3, 5, 10, 20}) EXPECT_GT(CutStack(n, 1, true, kLastStep).eigenvalues()[0], 1.5) << n;
    // The weight of a step that is just stable falls with the height above the cut.
    EXPECT_LT(CutStack(6, 1, true, 0.1).eigenvalues()[0], 1);
    EXPECT_GT(CutStack(20, 1, true, 0.1).eigenvalues()[0], 1);
}
