#include <algorithm>
#include <cmath>

#include "world/island_solver.h"

// Newton's method over all rows of an island at once; direct_solution.cpp says for what.

namespace sim {
namespace {

constexpr int kMostNewton = 40;       // of the velocities'
constexpr double kDecrement = 1e-16;  // Newton's, that is left: square of the error of y, share of y's
constexpr int kMostRounds = 3;        // of the contacts' proximal point iteration
constexpr int kMostSweeps = 10;       // over contacts that are not factorised
// Speeds by which a contact may miss what it demands: at rest [m/s], and as a share of the fastest.
constexpr double kLeftAtRest = 1e-6, kLeftShare = 1e-4;

}  // namespace

Eigen::Vector3d IslandSolver::seen(const Rows& rows, const AlignedDoubles& y) const {
    Eigen::Vector3d sum = rows.drift.cast<double>();
    for (int which = 0; which < 2; ++which) {
        const int body = rows.side[which].body;
        if (body < 0) continue;
        const int modes = sizes_[static_cast<std::size_t>(body)] - 6;
        const double* x = y.data() + rows_of_[static_cast<std::size_t>(body)].at;
        const double* d = wide_rows_.data() + rows.wide[which];
        for (int r = 0; r < 3; ++r, d += modes) {
            for (int i = 0; i < 6; ++i) sum[r] += *d++ * x[i];
            for (int i = 0; i < modes; ++i) sum[r] += d[i] * x[6 + i];
        }
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
        auto add = [&](int i) {
            x[i] += d[i] * impulse[0] + d[size + i] * impulse[1] + d[2 * size + i] * impulse[2];
        };
        for (int i = 0; i < 6; ++i) add(i);
        for (int i = 6; i < size; ++i) add(i);
    }
}

Eigen::Vector3d IslandSolver::impulse_of(const DirectContact& c, const Eigen::Vector3d& speed) const {
    if (!c.active) return Eigen::Vector3d::Zero();
    Eigen::Vector3d p(std::max(0., c.before[0] - (speed[0] + c.bias) / c.normal_gamma),
                      c.before[1] - speed[1] / c.tangent_gamma, c.before[2] - speed[2] / c.tangent_gamma);
    const double along = std::sqrt(p[1] * p[1] + p[2] * p[2]);
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
    for (std::size_t i = 0; with_contacts_ && i < contacts_.size(); ++i) {
        DirectContact& c = direct_contacts_[i];
        c.impulse = impulse_of(c, seen(contacts_[i], wide_y_));
        if (c.impulse != c.before) give(contacts_[i], c.before - c.impulse, gradient_);
    }
}

// Second derivatives of what a contact holds, by its speeds, at y.
Eigen::Matrix3d IslandSolver::weight_of(const ContactRows& contact, const DirectContact& c) const {
    Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
    if (c.impulse.isZero(0)) return weight;
    if (c.impulse[0] > 0) weight(0, 0) = 1 / c.normal_gamma;
    const Eigen::Vector2d u = seen(contact, wide_y_).tail<2>() - c.tangent_gamma * c.before.tail<2>();
    const double speed = u.norm();
    if (speed <= c.bound * c.tangent_gamma) {
        weight(1, 1) = weight(2, 2) = 1 / c.tangent_gamma;
    } else if (c.bound > 0) {
        const Eigen::Vector2d t = u / speed;
        weight.bottomRightCorner<2, 2>() =
            c.bound / speed * (Eigen::Matrix2d::Identity() - t * t.transpose());
    }
    return weight;
}

// The second derivatives at y, factorised, unless they are those that already are.
void IslandSolver::assemble() {
    bool same = factored_;
    for (std::size_t i = 0; with_contacts_ && i < contacts_.size(); ++i) {
        DirectContact& c = direct_contacts_[i];
        c.weight = weight_of(contacts_[i], c);
        same = same && c.weight == c.factored;
    }
    if (same) return;
    factored_ = true;
    factor_.reset();
    auto add = [this](const Rows& rows, const Eigen::Matrix3d& weight) {
        factor_.add(rows.side[0].body, wide_rows_.data() + rows.wide[0], rows.side[1].body,
                    wide_rows_.data() + rows.wide[1], weight);
    };
    for (const SpringRows& s : springs_) add(s, Eigen::Matrix3d::Identity() / s.gamma);
    for (std::size_t i = 0; with_contacts_ && i < contacts_.size(); ++i) {
        DirectContact& c = direct_contacts_[i];
        c.factored = c.weight;
        if (!c.weight.isZero(0)) add(contacts_[i], c.weight);
    }
    factor_.factor();
}

// Newton's method; where a step overshoots, its length is found by false position. Strictly convex: there is one minimum.
void IslandSolver::minimise() {
    const bool springs_only = contacts_.empty() || !with_contacts_;
    auto dot = [](const AlignedDoubles& a, const AlignedDoubles& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
        return sum;
    };
    gradient();
    const double enough = kDecrement * std::max(dot(wide_start_, wide_start_), 1e-30);
    for (int turn = 0; turn < kMostNewton; ++turn) {
        assemble();
        step_ = gradient_;
        factor_.solve(step_.data());
        const double slope = -dot(gradient_, step_);
        if (!(slope < (springs_only ? 0 : -enough))) return;
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
    }
}

double IslandSolver::left_open() const {
    double fastest = 0;
    for (const BodyRows& rows : rows_of_)
        fastest = std::max(fastest, rows.body->state.velocity.squaredNorm());
    return kLeftAtRest + kLeftShare * std::sqrt(fastest);
}

// The contacts' impulses and the velocities. Overlaps yield softly, so that how a load is shared out is defined; friction, and
// the second half's impulses, are held softly to what they were a round before (a proximal point iteration), with friction's
// bounds by that round, so that nothing of their softness is left.
void IslandSolver::settle_contacts() {
    if (!with_contacts_) return settle_in_turn();
    const double enough = left_open();
    for (int round = 0; round < kMostRounds; ++round) {
        minimise();
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

// How speeds at a contact answer its impulses.
void IslandSolver::set_mobility(const ContactRows& c, DirectContact& d) const {
    d.mobility.setZero();
    for (int which = 0; which < 2; ++which) {
        const int body = c.side[which].body;
        if (body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(body)];
        const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>> rows(
            wide_rows_.data() + c.wide[which], 3, size);
        d.mobility.noalias() += rows.lazyProduct(rows.transpose());
    }
    d.tangent_inverse = d.mobility.bottomRightCorner<2, 2>().inverse();
}

// One contact for itself: without compliance, but for soft ones along the normal. Its change.
Eigen::Vector3d IslandSolver::solve_alone(const ContactRows& c, DirectContact& d) const {
    if (!d.active) return Eigen::Vector3d::Zero();
    const Eigen::Matrix3d& k = d.mobility;
    Eigen::Vector3d v = seen(c, wide_y_), p = d.impulse;
    p[0] = std::max(0., (k(0, 0) * p[0] - v[0] - d.bias) / (k(0, 0) + (d.soft ? d.normal_gamma : 0)));
    v += k.col(0) * (p[0] - d.impulse[0]);
    const Eigen::Vector2d stick = p.tail<2>() - d.tangent_inverse * v.tail<2>();
    const double most = static_cast<double>(c.friction) * p[0];
    if (stick.squaredNorm() <= most * most) {
        p.tail<2>() = stick;
    } else {
        const Eigen::Vector2d slide = p.tail<2>() - static_cast<double>(c.slide_mass) * v.tail<2>();
        p.tail<2>() = slide * (most / std::max(slide.norm(), 1e-300));
    }
    const Eigen::Vector3d change = p - d.impulse;
    d.impulse = p;
    return change;
}

// Springs all at once and contacts one after the other, in turn: each lowers what is left of the energy of
// y, so that few sweeps leave contacts open but give no energy.
void IslandSolver::settle_in_turn() {
    const double enough = left_open();
    minimise();
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        double missed = 0;
        for (std::size_t i = 0; i < contacts_.size(); ++i) {
            const Eigen::Vector3d change = solve_alone(contacts_[i], direct_contacts_[i]);
            if (change.isZero(0)) continue;
            give(contacts_[i], change, wide_y_);
            give(contacts_[i], change, wide_start_);
            missed = std::max(missed, (direct_contacts_[i].mobility * change).norm());
        }
        minimise();
        if (missed <= enough) return;
    }
}

}  // namespace sim
