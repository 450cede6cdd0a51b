#include <algorithm>
#include <cmath>

#include "world/island_solver.h"

// Newton's method over all rows of an island at once; direct_solution.cpp says for what.

namespace sim {
namespace {

constexpr int kMostNewton = 40;  // of the velocities'
constexpr int kMostRounds = 4;   // of the contacts' proximal point iteration
// Speeds by which a contact may miss what it demands: at rest [m/s], and as a share of the fastest.
constexpr double kLeftAtRest = 1e-6, kLeftShare = 1e-4;

}  // namespace

Eigen::Vector3d IslandSolver::seen(const Rows& rows, const AlignedDoubles& y) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int which = 0; which < 2; ++which) {
        const int body = rows.side[which].body;
        if (body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(body)];
        const double* x = y.data() + rows_of_[static_cast<std::size_t>(body)].at;
        const double* d = wide_rows_.data() + rows.wide[which];
        for (int r = 0; r < 3; ++r)
            for (int i = 0; i < size; ++i) sum[r] += d[r * size + i] * x[i];
    }
    return sum;
}

void IslandSolver::give(const Rows& rows, const Eigen::Vector3d& impulse, AlignedDoubles& y) const {
    for (int which = 0; which < 2; ++which) {
        const int body = rows.side[which].body;
        if (body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(body)];
        double* x = y.data() + rows_of_[static_cast<std::size_t>(body)].at;
        const double* d = wide_rows_.data() + rows.wide[which];
        for (int i = 0; i < size; ++i)
            x[i] += d[i] * impulse[0] + d[size + i] * impulse[1] + d[2 * size + i] * impulse[2];
    }
}

Eigen::Vector3d IslandSolver::impulse_of(const DirectContact& c, const Eigen::Vector3d& speed) const {
    if (!c.active) return Eigen::Vector3d::Zero();
    Eigen::Vector3d p(std::max(0., c.before[0] - (speed[0] + c.bias) / c.normal_gamma),
                      c.before[1] - speed[1] / c.tangent_gamma, c.before[2] - speed[2] / c.tangent_gamma);
    const double along = std::hypot(p[1], p[2]);
    if (along > c.bound) p.tail<2>() *= c.bound / along;
    return p;
}

// Of 1/2 |y - start|^2 + what the springs and contacts hold, and the impulses at y.
void IslandSolver::gradient() {
    for (std::size_t i = 0; i < wide_y_.size(); ++i) gradient_[i] = wide_y_[i] - wide_start_[i];
    for (SpringRows& s : springs_) {
        s.impulse = -(seen(s, wide_y_) + s.offset) / s.gamma;
        give(s, -s.impulse, gradient_);
    }
    for (std::size_t i = 0; direct_ && i < contacts_.size(); ++i) {
        DirectContact& c = direct_contacts_[i];
        c.impulse = impulse_of(c, seen(contacts_[i], wide_y_));
        if (c.impulse != c.before) give(contacts_[i], c.before - c.impulse, gradient_);
    }
}

void IslandSolver::assemble() {
    factor_.reset();
    auto add = [this](const Rows& rows, const Eigen::Matrix3d& weight) {
        factor_.add(rows.side[0].body, wide_rows_.data() + rows.wide[0], rows.side[1].body,
                    wide_rows_.data() + rows.wide[1], weight);
    };
    for (const SpringRows& s : springs_) add(s, Eigen::Matrix3d::Identity() / s.gamma);
    for (std::size_t i = 0; direct_ && i < contacts_.size(); ++i) {
        const DirectContact& c = direct_contacts_[i];
        if (c.impulse.isZero(0)) continue;
        Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
        if (c.impulse[0] > 0) weight(0, 0) = 1 / c.normal_gamma;
        const Eigen::Vector2d u =
            seen(contacts_[i], wide_y_).tail<2>() - c.tangent_gamma * c.before.tail<2>();
        const double speed = u.norm();
        if (speed <= c.bound * c.tangent_gamma) {
            weight(1, 1) = weight(2, 2) = 1 / c.tangent_gamma;
        } else if (c.bound > 0) {
            const Eigen::Vector2d t = u / speed;
            weight.bottomRightCorner<2, 2>() =
                c.bound / speed * (Eigen::Matrix2d::Identity() - t * t.transpose());
        }
        add(contacts_[i], weight);
    }
    factor_.factor();
}

// Newton's method with an exact line search; strictly convex, so it ends at the one minimum.
void IslandSolver::minimise(bool springs_only) {
    auto dot = [](const AlignedDoubles& a, const AlignedDoubles& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
        return sum;
    };
    gradient();
    const double enough = 1e-14 * std::max(dot(wide_start_, wide_start_), 1e-30);
    for (int turn = 0; turn < kMostNewton; ++turn) {
        assemble();
        step_ = gradient_;
        factor_.solve(step_.data());
        const double slope = -dot(gradient_, step_);
        if (!(slope < 0)) return;
        // wide_y_ - t step: the slope along it grows with t.
        double t = 0, low = 0, high = 0, at_low = slope, at_high = 0;
        auto go = [&](double to) {
            for (std::size_t i = 0; i < wide_y_.size(); ++i) wide_y_[i] -= (to - t) * step_[i];
            t = to;
            gradient();
            return -dot(gradient_, step_);
        };
        double rise = go(1);
        if (springs_only) return;
        if (rise > 0.5 * -slope) {
            high = 1, at_high = rise;
            for (int i = 0; i < 20 && std::abs(rise) > 0.5 * -slope; ++i) {
                double next = low - at_low * (high - low) / (at_high - at_low);
                next = std::clamp(next, low + 0.1 * (high - low), high - 0.1 * (high - low));
                rise = go(next);
                if (rise > 0)
                    high = next, at_high = rise;
                else
                    low = next, at_low = rise;
            }
        }
        if (dot(gradient_, gradient_) < enough) return;
    }
}

// The contacts' impulses and the velocities. Overlaps yield softly, so that how a load is shared out is defined; friction, and
// the second half's impulses, are held softly to what they were a round before (a proximal point iteration), with friction's
// bounds by that round, so that nothing of their softness is left.
void IslandSolver::settle_contacts() {
    double fastest = 0;
    for (const BodyRows& rows : rows_of_)
        fastest = std::max(fastest, rows.body->state.velocity.squaredNorm());
    const double enough = kLeftAtRest + kLeftShare * std::sqrt(fastest);
    for (int round = 0; round < kMostRounds; ++round) {
        minimise(contacts_.empty());
        double missed = 0;
        for (std::size_t i = 0; i < contacts_.size(); ++i) {
            DirectContact& d = direct_contacts_[i];
            Eigen::Vector3d change = d.impulse - d.before;
            if (d.soft) change[0] = 0;
            missed = std::max(
                {missed, d.normal_gamma * std::abs(change[0]), d.tangent_gamma * change.tail<2>().norm()});
            give(contacts_[i], change, wide_start_);
            d.before += change;
            d.bound = static_cast<double>(contacts_[i].friction) * d.impulse[0];
        }
        if (missed <= enough) return;
    }
}

}  // namespace sim
