#include "solver/newton_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// Steps of a minimisation; three to six are usual. Without: friction that is firm makes Newton's method crawl.
constexpr int kMostNewton = 40;
// [y^2] What is left of Newton's decrement, share of y's square: an error of 1e-8. Larger: joints gain energy.
constexpr double kDecrement = 1e-16;
// Rounds of the contacts' proximal point iteration. Fewer: impulses keep some of their softness, and stacks sink.
constexpr int kMostRounds = 3;
// Sweeps over contacts that are too dear to factorise, in turn with springs.
constexpr int kMostSweeps = 10;
// Speeds by which a contact may miss what it demands: at rest [m/s], and as a share of the fastest body's. Smaller: rounds that
// change nothing one could see.
constexpr double kLeftAtRest = 1e-6, kLeftShare = 1e-4;

}  // namespace

bool NewtonSolver::begin(double most, bool must, bool springs_are_soft) {
    if (!must && springs_are_soft && is_too_dear(most)) return false;
    sizes_.clear();
    for (const BodyRows& body : rows_.bodies) sizes_.push_back(6 + body.body->kind->modes);
    auto couple = [&](bool with_contacts) {
        factor_.begin(sizes_);
        if (with_contacts)
            rows_.each_manifold([this](const Manifold& m) {
                factor_.couple(rows_.local(m.a), m.b < kFirstPlane ? rows_.local(m.b) : -1);
            });
        for (const SpringRows& s : rows_.springs) factor_.couple(s.side[0].body, s.side[1].body);
    };
    couple(true);
    with_contacts_ = factor_.least_cost() <= most && std::isfinite(factor_.analyse(most));
    if (!with_contacts_) {
        if (!must && springs_are_soft) return false;
        couple(false);
        (void)factor_.analyse(std::numeric_limits<double>::infinity());
    }
    reserve();
    return true;
}

void NewtonSolver::reserve() {
    std::uint32_t at = 0, wide = 0;
    for (std::size_t i = 0; i < rows_.bodies.size(); ++i) {
        rows_.bodies[i].at = at;
        at += static_cast<std::uint32_t>(sizes_[i]);
    }
    for (auto* list : {&y, &start, &free, &held, &gradient_, &step_}) list->assign(at, 0.);
    auto reserve = [&](Rows& rows) {
        for (int side = 0; side < 2; ++side) {
            if (rows.side[side].body < 0) continue;
            rows.wide[side] = wide;
            wide += 3 * static_cast<std::uint32_t>(sizes_[static_cast<std::size_t>(rows.side[side].body)]);
        }
    };
    for (ContactRows& c : rows_.contacts) reserve(c);
    for (SpringRows& s : rows_.springs) reserve(s);
    wide_rows_.resize(wide);
    contacts.assign(rows_.contacts.size(), {});
}

// Whether a factorisation with the contacts certainly takes more, see BlockCholesky::least_cost: told early.
bool NewtonSolver::is_too_dear(double most) const {
    const std::vector<int>& of_island = rows_.island->manifolds;
    if (rows_.found_again || of_island.size() < kLeastDivided) return false;
    double cost = 0;
    std::uint64_t last = ~std::uint64_t{0};
    for (std::size_t i = 0; i < of_island.size() && cost <= 1.001 * most; ++i) {
        const Manifold& m = rows_.manifolds[static_cast<std::size_t>(of_island[i])];
        if (m.b >= kFirstPlane || rows_.local(m.a) < 0 || rows_.local(m.b) < 0 ||
            std::exchange(last, m.key()) == m.key())
            continue;
        const double a = 6 + rows_.bodies[static_cast<std::size_t>(rows_.local(m.a))].body->kind->modes,
                     b = 6 + rows_.bodies[static_cast<std::size_t>(rows_.local(m.b))].body->kind->modes;
        cost += a * b * (a + b) / 2;
    }
    return cost > 1.001 * most;
}

void NewtonSolver::widen(Rows& rows, double modes_yield) {
    for (int which = 0; which < 2; ++which) {
        const RowSide& side = rows.side[which];
        if (side.body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(side.body)];
        for (int r = 0; r < 3; ++r) {
            const float* from = rows_.jacobians.data() + side.rows + r * side.width;
            double* to = wide_rows_.data() + rows.wide[which] + r * size;
            std::copy_n(from, 6, to);
            for (int k = 6; k < size; ++k) to[k] = modes_yield * from[2 + k];
        }
    }
}

Eigen::Vector3d NewtonSolver::seen(const Rows& rows, const AlignedDoubles& of) const {
    Eigen::Vector3d sum = rows.drift.cast<double>();
    for (int which = 0; which < 2; ++which) {
        const int body = rows.side[which].body;
        if (body < 0) continue;
        const int modes = sizes_[static_cast<std::size_t>(body)] - 6;
        const double* x = of.data() + rows_.bodies[static_cast<std::size_t>(body)].at;
        const double* d = wide_rows_.data() + rows.wide[which];
        for (int r = 0; r < 3; ++r, d += modes) {
            for (int i = 0; i < 6; ++i) sum[r] += *d++ * x[i];
            for (int i = 0; i < modes; ++i) sum[r] += d[i] * x[6 + i];
        }
    }
    return sum;
}

void NewtonSolver::give(const Rows& rows, const Eigen::Vector3d& impulse, AlignedDoubles& to) const {
    for (int which = 0; which < 2; ++which) {
        const int body = rows.side[which].body;
        if (body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(body)];
        double* x = to.data() + rows_.bodies[static_cast<std::size_t>(body)].at;
        const double* d = wide_rows_.data() + rows.wide[which];
        auto add = [&](int i) {
            x[i] += d[i] * impulse[0] + d[size + i] * impulse[1] + d[2 * size + i] * impulse[2];
        };
        for (int i = 0; i < 6; ++i) add(i);
        for (int i = 6; i < size; ++i) add(i);
    }
}

Eigen::Vector3d NewtonSolver::impulse_of(const DirectContact& c, const Eigen::Vector3d& speed) const {
    if (!c.active) return Eigen::Vector3d::Zero();
    Eigen::Vector3d p(std::max(0., c.before[0] - (speed[0] + c.bias) / c.normal_gamma),
                      c.before[1] - speed[1] / c.tangent_gamma, c.before[2] - speed[2] / c.tangent_gamma);
    const double along = std::sqrt(p[1] * p[1] + p[2] * p[2]);
    if (along > c.bound) p.tail<2>() *= c.bound / along;
    return p;
}

// Of 1/2 |y - start|^2 + what the springs and contacts hold, and the impulses at y.
void NewtonSolver::find_gradient() {
    for (std::size_t i = 0; i < y.size(); ++i) gradient_[i] = y[i] - start[i];
    for (SpringRows& s : rows_.springs) {
        s.impulse = -(seen(s, y) + s.offset) / s.gamma;
        give(s, -s.impulse, gradient_);
    }
    for (std::size_t i = 0; with_contacts_ && i < rows_.contacts.size(); ++i) {
        DirectContact& c = contacts[i];
        c.impulse = impulse_of(c, seen(rows_.contacts[i], y));
        if (c.impulse != c.before) give(rows_.contacts[i], c.before - c.impulse, gradient_);
    }
}

// Second derivatives of what a contact holds, by its speeds, at y.
Eigen::Matrix3d NewtonSolver::weight_of(const ContactRows& contact, const DirectContact& c) const {
    Eigen::Matrix3d weight = Eigen::Matrix3d::Zero();
    if (c.impulse.isZero(0)) return weight;
    if (c.impulse[0] > 0) weight(0, 0) = 1 / c.normal_gamma;
    const Eigen::Vector2d u = seen(contact, y).tail<2>() - c.tangent_gamma * c.before.tail<2>();
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
void NewtonSolver::assemble() {
    bool same = factored_;
    for (std::size_t i = 0; with_contacts_ && i < rows_.contacts.size(); ++i) {
        DirectContact& c = contacts[i];
        c.weight = weight_of(rows_.contacts[i], c);
        same = same && c.weight == c.factored;
    }
    if (same) return;
    factored_ = true;
    factor_.reset();
    auto add = [this](const Rows& rows, const Eigen::Matrix3d& weight) {
        factor_.add(rows.side[0].body, wide_rows_.data() + rows.wide[0], rows.side[1].body,
                    wide_rows_.data() + rows.wide[1], weight);
    };
    for (const SpringRows& s : rows_.springs) add(s, Eigen::Matrix3d::Identity() / s.gamma);
    for (std::size_t i = 0; with_contacts_ && i < rows_.contacts.size(); ++i) {
        DirectContact& c = contacts[i];
        c.factored = c.weight;
        if (!c.weight.isZero(0)) add(rows_.contacts[i], c.weight);
    }
    factor_.factor();
}

// Newton's method; where a step overshoots, its length is found by false position. Strictly convex: there is one minimum.
void NewtonSolver::minimise() {
    const bool springs_only = rows_.contacts.empty() || !with_contacts_;
    auto dot = [](const AlignedDoubles& a, const AlignedDoubles& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
        return sum;
    };
    find_gradient();
    const double enough = kDecrement * std::max(dot(start, start), 1e-30);
    for (int turn = 0; turn < kMostNewton; ++turn) {
        assemble();
        step_ = gradient_;
        factor_.solve(step_.data());
        const double slope = -dot(gradient_, step_);
        if (!(slope < (springs_only ? 0 : -enough))) return;
        // y - t step: the slope along it grows with t.
        double t = 0, low = 0, high = 0, at_low = slope, at_high = 0;
        auto go = [&](double to) {
            for (std::size_t i = 0; i < y.size(); ++i) y[i] -= (to - t) * step_[i];
            t = to;
            find_gradient();
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

double NewtonSolver::left_open() const {
    double fastest = 0;
    for (const BodyRows& rows : rows_.bodies)
        fastest = std::max(fastest, rows.body->state.velocity.squaredNorm());
    return kLeftAtRest + kLeftShare * std::sqrt(fastest);
}

// The contacts' impulses and the velocities, in rounds (a proximal point iteration). In a round an impulse without compliance may
// differ from the round before's at a cost, and friction is bounded by the normal impulse of the round before. The rounds end where
// nothing changes any more, so nothing is left of that cost.
void NewtonSolver::settle_contacts() {
    if (!with_contacts_) return settle_in_turn();
    const double enough = left_open();
    for (int round = 0; round < kMostRounds; ++round) {
        minimise();
        double missed = 0;
        for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
            DirectContact& d = contacts[i];
            Eigen::Vector3d change = d.impulse - d.before;
            if (d.soft) change[0] = 0;
            missed = std::max(
                {missed, d.normal_gamma * std::abs(change[0]), d.tangent_gamma * change.tail<2>().norm()});
            give(rows_.contacts[i], change, start);
            d.before += change;
            d.bound = static_cast<double>(rows_.contacts[i].friction) * d.impulse[0];
        }
        if (missed <= enough) return;
    }
}

void NewtonSolver::begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far) {
    DirectContact& contact = contacts[i];
    give(rows_.contacts[i], contact.before - seen_so_far, start);
    contact.impulse = contact.before;
    if (!with_contacts_) set_mobility(rows_.contacts[i], contact);
}

void NewtonSolver::hold_modes(double modes_yield) {
    std::ranges::fill(gradient_, 0.);
    for (std::size_t i = 0; i < contacts.size(); ++i) give(rows_.contacts[i], contacts[i].impulse, gradient_);
    for (const SpringRows& s : rows_.springs) give(s, s.moved, gradient_);
    for (const BodyRows& body : rows_.bodies)
        for (std::size_t k = 6; k < 6 + static_cast<std::size_t>(body.body->kind->modes); ++k)
            held[body.at + k] = gradient_[body.at + k] / modes_yield;
}

// How speeds at a contact answer its impulses.
void NewtonSolver::set_mobility(const ContactRows& c, DirectContact& d) const {
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
Eigen::Vector3d NewtonSolver::solve_alone(const ContactRows& c, DirectContact& d) const {
    if (!d.active) return Eigen::Vector3d::Zero();
    const Eigen::Matrix3d& k = d.mobility;
    Eigen::Vector3d v = seen(c, y), p = d.impulse;
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
void NewtonSolver::settle_in_turn() {
    const double enough = left_open();
    minimise();
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        double missed = 0;
        for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
            const Eigen::Vector3d change = solve_alone(rows_.contacts[i], contacts[i]);
            if (change.isZero(0)) continue;
            give(rows_.contacts[i], change, y);
            give(rows_.contacts[i], change, start);
            missed = std::max(missed, (contacts[i].mobility * change).norm());
        }
        minimise();
        if (missed <= enough) return;
    }
}

}  // namespace sim
