#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "world/island_solver.h"

// Islands solved directly, in substeps of two halves; see IslandSolver.

namespace sim {
namespace {

constexpr double kFirm = 1e-9;  // least compliance of a spring, share of the bodies' own
constexpr double kSoft = 3e-4;  // compliance of an overlap over a substep, share of the bodies' own, at most
constexpr double kOverlap =
    1e-4;  // at which it carries its load of the substep before, share of the bodies' size
// Its least, well above that of springs, so that loads stay finite where these hold bodies inside each other.
constexpr double kHardest = 1e-5;
constexpr double kHeld = 1e-2, kHeldAlong = 0.1;  // of a contact's impulse to the round before's; friction's
constexpr double kCorrected = 0.2;                // share of an overlap that a substep takes back
constexpr int kMostTurns = 12;                    // of the ends' Newton iteration
constexpr double kResolved = 0.25;                // h^2 k / m of a spring up to which its motion is followed
constexpr double kSoftSpring = 0.05, kMostDamped = 0.5;  // see springs_are_soft
constexpr double kEndTolerance = 1e-8;                   // of a gap, share of a body's size
constexpr double kMostFall = 1.2e-3;                     // in a substep, share of a body's size
constexpr int kMostFallLevel = 6;                        // for that a substep is halved so often at most
constexpr double kFree = 1e6;                            // of a speed: no contact holds it [m/s]
constexpr double kMostTurn = 0.04;                       // of a spring's arm in a substep [rad]

}  // namespace

Eigen::Vector3d IslandSolver::in_world(const ContactRows& c, const Eigen::Vector3d& p) const {
    return p[0] * c.point->normal.cast<double>() + p[1] * c.tangent[0].cast<double>() +
           p[2] * c.tangent[1].cast<double>();
}

// Prepares a direct solution; false: a factorisation takes more than so many multiply-adds. Stiff springs are solved directly
// all the same, with sweeps over the contacts.
bool IslandSolver::may_go_directly(double most, bool must) {
    if (!must && is_too_dear(most) && springs_soft_) return false;
    sizes_.clear();
    for (const BodyRows& rows : rows_of_) sizes_.push_back(6 + rows.body->kind->modes);
    auto couple_manifold = [this](const Manifold& m) {
        factor_.couple(local(m.a), m.b < kFirstPlane ? local(m.b) : -1);
    };
    auto couple = [&](bool with_contacts) {
        factor_.begin(sizes_);
        if (with_contacts && found_again_)
            for (const Manifold& m : found_) couple_manifold(m);
        else if (with_contacts)
            for (const int m : island_->manifolds)
                couple_manifold((*manifolds_)[static_cast<std::size_t>(m)]);
        for (const SpringRows& s : springs_) factor_.couple(s.side[0].body, s.side[1].body);
    };
    couple(true);
    with_contacts_ = factor_.least_cost() <= most && std::isfinite(factor_.analyse(most));
    if (with_contacts_) return true;
    if (!must && springs_soft_) return false;
    couple(false);
    (void)factor_.analyse(std::numeric_limits<double>::infinity());
    return true;
}

bool IslandSolver::begin_direct(double most, bool must) {
    if (!may_go_directly(most, must)) return false;
    std::uint32_t at = 0, wide = 0;
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        rows_of_[i].at = at;
        at += static_cast<std::uint32_t>(sizes_[i]);
    }
    direct_ = true;
    for (auto* list : {&wide_y_, &wide_start_, &wide_free_, &wide_held_, &gradient_, &step_})
        list->assign(at, 0.);
    ends_.resize(rows_of_.size());
    auto reserve = [&](Rows& rows) {
        for (int side = 0; side < 2; ++side) {
            if (rows.side[side].body < 0) continue;
            rows.wide[side] = wide;
            wide += 3 * static_cast<std::uint32_t>(sizes_[static_cast<std::size_t>(rows.side[side].body)]);
        }
    };
    for (ContactRows& c : contacts_) reserve(c);
    for (SpringRows& s : springs_) reserve(s);
    wide_rows_.resize(wide);
    direct_contacts_.assign(contacts_.size(), {});
    return true;
}

// Whether a factorisation with the contacts certainly takes more, see BlockCholesky::least_cost: told early.
bool IslandSolver::is_too_dear(double most) const {
    const std::vector<int>& of_island = island_->manifolds;
    if (found_again_ || of_island.size() < kLeastDivided) return false;
    double cost = 0;
    std::uint64_t last = ~std::uint64_t{0};
    for (std::size_t i = 0; i < of_island.size() && cost <= 1.001 * most; ++i) {
        const Manifold& m = (*manifolds_)[static_cast<std::size_t>(of_island[i])];
        if (m.b >= kFirstPlane || local(m.a) < 0 || local(m.b) < 0 || std::exchange(last, m.key()) == m.key())
            continue;
        const double a = 6 + rows_of_[static_cast<std::size_t>(local(m.a))].body->kind->modes,
                     b = 6 + rows_of_[static_cast<std::size_t>(local(m.b))].body->kind->modes;
        cost += a * b * (a + b) / 2;
    }
    return cost > 1.001 * most;
}

// The rows in double precision, without padding. Over the first half of a substep's impulses modes yield as they will to
// the whole, that is to twice as much.
void IslandSolver::widen(Rows& rows, bool positions) {
    const double yields = mode_scale(positions);
    for (int which = 0; which < 2; ++which) {
        const Side& side = rows.side[which];
        if (side.body < 0) continue;
        const int size = sizes_[static_cast<std::size_t>(side.body)];
        for (int r = 0; r < 3; ++r) {
            const float* from = jacobians_.data() + side.rows + r * side.width;
            double* to = wide_rows_.data() + rows.wide[which] + r * size;
            std::copy_n(from, 6, to);
            for (int k = 6; k < size; ++k) to[k] = yields * from[2 + k];
        }
    }
}

// Rows follow the bodies.
void IslandSolver::follow(bool positions) {
    factored_ = false;
    for (BodyRows& rows : rows_of_) {
        rows.place = rows.body->state.position;
        rows.frame = rows.body->state.orientation.toRotationMatrix();
        rows.body_from_world = rows.frame.transpose().cast<float>();
    }
    for (SpringRows& s : springs_) write_spring(s), widen(s, positions);
    for (ContactRows& c : contacts_) write_contact(c), widen(c, positions);
}

// Half of the substep's gravity and forces.
void IslandSolver::kick() {
    count_forces(0.5);
    for (const BodyRows& rows : rows_of_) {
        MovingBody& body = *rows.body;
        const double mass = body.kind->mass.mass;
        const Eigen::Vector3d change = h_ / 2 * body.gravity_scale * settings_->gravity;
        body.state.velocity += change;
        if (body.own) outside_ += mass * change;
        if (!body.pushed) continue;
        body.state.velocity += h_ / 2 / mass * body.force;
        body.state.angular_momentum += h_ / 2 * body.torque;
    }
}

// The bodies' velocities after a share of the substep's gravity and forces, and their modes' mean rates under
// what has been given to them.
void IslandSolver::load_wide(bool positions) {
    const double share = positions ? 0.5 : 0, scale = 1 / mode_scale(positions);
    for (const BodyRows& rows : rows_of_) {
        const MovingBody& body = *rows.body;
        const BodyKind& kind = *body.kind;
        const WorldBodyState& s = body.state;
        const Eigen::Matrix3d turned = s.orientation.toRotationMatrix();
        Eigen::Vector3d velocity = s.velocity + share * h_ * body.gravity_scale * settings_->gravity;
        Eigen::Vector3d momentum = s.angular_momentum;
        if (body.pushed) {
            velocity += share * h_ / kind.mass.mass * body.force;
            momentum += share * h_ * body.torque;
        }
        const Eigen::Vector3d spin =
            rows.frame.transpose() *
            (turned * (turned.transpose() * momentum).cwiseQuotient(kind.mass.inertia));
        double* y = wide_free_.data() + rows.at;
        for (int i = 0; i < 3; ++i) {
            y[i] = kind.root_mass * velocity[i];
            y[3 + i] = kind.root_inertia[i] * spin[i];
        }
        const HeldSteps& step = of_substep(kind).held;
        for (int k = 0; k < kind.modes; ++k) {
            y[6 + k] = (step.mean_z[k] * s.q[k] + step.mean_rate[k] * s.q_dot[k]) / step.root_compliance[k] +
                       wide_held_[rows.at + 6 + static_cast<std::size_t>(k)];
            if (body.pushed) y[6 + k] += step.root_compliance[k] * h_ * body.modal_force[k];
            y[6 + k] *= scale;
        }
    }
    wide_start_ = wide_free_;
}

void IslandSolver::find_ends() {
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        const BodyRows& rows = rows_of_[i];
        const BodyKind& kind = *rows.body->kind;
        const WorldBodyState& s = rows.body->state;
        const double *y = wide_y_.data() + rows.at, *start = wide_free_.data() + rows.at;
        Eigen::Vector3d change;
        for (int k = 0; k < 3; ++k) change[k] = kind.root_inertia[k] * (y[3 + k] - start[3 + k]);
        ends_[i].position = s.position + h_ / kind.root_mass * Eigen::Vector3d(y[0], y[1], y[2]);
        Eigen::Vector3d momentum = s.angular_momentum + rows.frame * change;
        if (rows.body->pushed) momentum += h_ / 2 * rows.body->torque;
        ends_[i].orientation = rows.rotation.advance(s.orientation, momentum);
        ends_[i].momentum = momentum;
    }
}

// Between a spring's ends where the substep's velocities bring them.
Eigen::Vector3d IslandSolver::gap_at_end(const SpringRows& spring) const {
    const PointConstraint& held = spring.constraint->definition;
    auto end = [this](int body, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
        if (body < 0) return rest;
        const MovingBody& b = (*bodies_)[static_cast<std::size_t>(body)];
        if (local(body) < 0) {
            const BodyPath::Pose pose = pose_of(body, time_ + h_);
            return pose.position + pose.orientation * rest;
        }
        const auto i = static_cast<std::size_t>(local(body));
        const BodyKind& kind = *b.kind;
        Eigen::Vector3d point = rest;
        if (kind.modes > 0) {
            alignas(32) float shapes[3 * kMostModes];
            kind.shapes_at(rest.cast<float>(), shapes);
            const double* y = wide_y_.data() + rows_of_[i].at + 6;
            for (int k = 0; k < kind.modes; ++k) {
                const double q =
                    b.state.q[k] + mode_scale(true) * h_ * of_substep(kind).held.root_compliance[k] * y[k];
                for (int axis = 0; axis < 3; ++axis)
                    point[axis] += static_cast<double>(shapes[axis * kind.mode_width + k]) * q;
            }
        }
        return ends_[i].position + ends_[i].orientation * point;
    };
    return spring.point->gap(end(held.body_a, spring.point->a), end(held.body_b, spring.point->b),
                             orientation_at_end(held.body_b));
}

Eigen::Quaterniond IslandSolver::orientation_at_end(int body) const {
    const int i = body < 0 ? -1 : local(body);
    if (body >= 0 && i < 0) return pose_of(body, time_ + h_).orientation;
    return i < 0 ? Eigen::Quaterniond::Identity() : ends_[static_cast<std::size_t>(i)].orientation;
}

// Whether no spring's arm turns further than the scheme is accurate for: the energy of a turn of t in a substep
// is off by about t^2 / 12 of itself for as long as it lasts.
bool IslandSolver::turns_little() const {
    for (const SpringRows& s : springs_) {
        const PointConstraint& held = s.constraint->definition;
        for (int side = 0; side < 2; ++side) {
            if (s.side[side].body < 0) continue;
            const auto i = static_cast<std::size_t>(s.side[side].body);
            auto turns = [&](const Eigen::Vector3d& arm) {
                const Eigen::Vector3d turn = ends_[i].orientation * arm - rows_of_[i].frame * arm;
                return turn.squaredNorm() > kMostTurn * kMostTurn * arm.squaredNorm();
            };
            // So do the directions, but for a hinge's about its axis, which are alike.
            if (turns(side == 0 ? s.point->a : s.point->b) ||
                (s.point->turns &&
                 turns((side == 0 ? held.frame_a : held.frame_b) * Eigen::Vector3d::UnitX())))
                return false;
        }
    }
    return true;
}

// The least half extent of the bodies that rows join [m].
double IslandSolver::size_of(const Rows& rows) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Side& side : rows.side)
        if (side.body >= 0)
            least = std::min(least,
                             rows_of_[static_cast<std::size_t>(side.body)].body->kind->half_box.minCoeff());
    return least;
}

// A contact's problem of one half: what the start has seen of it, and the speed that is wanted.
void IslandSolver::begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far,
                                 const Eigen::Vector3d& guess, double bias, bool positions) {
    const ContactRows& c = contacts_[i];
    DirectContact& d = direct_contacts_[i];
    d.soft = positions;
    const double by_load =
        std::max(kHardest * c.k[0][0], kCorrected * kOverlap * size_of(c) * settings_->substeps /
                                           (settings_->dt * std::max(c.at_move[0], 0.f)));
    const double softest = (positions ? kSoft : kHeld) * c.k[0][0];
    d.normal_gamma = c.emerging ? softest : std::min(softest, positions ? by_load : 10 * by_load);
    d.tangent_gamma = kHeldAlong / c.slide_mass;
    d.bias = bias;
    d.active = c.starts < time_ + h_;
    d.before = d.active ? guess : Eigen::Vector3d(Eigen::Vector3d::Zero());
    d.bound = c.friction * d.before[0];
    give(c, d.before - seen_so_far, wide_start_);
    d.impulse = d.before;
    if (!with_contacts_) set_mobility(c, d);
}

// Whether the springs' ends were brought to where they belong.
bool IslandSolver::solve_positions() {
    const double whole = settings_->dt / settings_->substeps;
    const double scale = h_ / last_h_;  // the impulses of the substep before, over this one
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const ContactRows& c = contacts_[i];
        const double now = c.now;
        begin_contact(i, Eigen::Vector3d::Zero(), scale * Eigen::Vector3d(0, c.at_move[1], c.at_move[2]),
                      now > 0 ? now / h_ : std::max(kCorrected * now / whole, -double{kPushSpeed}), true);
    }
    wide_y_ = wide_start_;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const double normal = scale * static_cast<double>(contacts_[i].at_move[0]);
        direct_contacts_[i].bound = static_cast<double>(contacts_[i].friction) * normal;
        give(contacts_[i], {normal, 0, 0}, wide_y_);
        if (with_contacts_) continue;
        direct_contacts_[i].impulse[0] = normal;
        give(contacts_[i], {normal, 0, 0}, wide_start_);
    }
    for (SpringRows& s : springs_) {
        set_firmness(s, true);
        give(s, scale * s.moved, wide_y_);
    }
    double before = std::numeric_limits<double>::infinity(), size = before;
    for (const SpringRows& s : springs_) size = std::min(size, size_of(s));
    const double enough = kEndTolerance * size;
    const int settles = springs_.empty() ? 0 : 1;  // the turn, once near the ends
    for (int turn = 0; turn <= kMostTurns; ++turn) {
        find_ends();
        double worst = 0;
        for (SpringRows& s : springs_) {
            const Eigen::Vector3d gap = gap_at_end(s) + s.lag * s.gap;
            worst = std::max(worst, (gap + h_ * s.gamma * s.impulse).norm());
            s.offset = gap / h_ - seen(s, wide_y_);
        }
        if (turn > (contacts_.empty() ? 0 : settles) && worst <= enough) return turns_little();
        if (turn == kMostTurns || !(turn < 2 || worst < 0.7 * before)) return false;
        if (turn > 0) before = worst;
        turn == settles || !with_contacts_ ? settle_contacts() : minimise();
    }
    return false;
}

// y_ and start_ from a half's solution, for what is measured and put right in single precision.
void IslandSolver::narrow(bool positions) {
    const double scale = mode_scale(positions);
    for (const BodyRows& rows : rows_of_) {
        float *y = y_.data() + rows.offset, *start = start_.data() + rows.offset;
        const double *wide = wide_y_.data() + rows.at, *before = wide_free_.data() + rows.at;
        const int modes = rows.body->kind->modes;
        for (int i = 0; i < 6; ++i)
            y[i] = static_cast<float>(wide[i]), start[i] = static_cast<float>(before[i]);
        for (int k = 6; k < 6 + modes; ++k) {
            y[2 + k] = static_cast<float>(scale * wide[k]);
            start[2 + k] =
                static_cast<float>(scale * before[k] - wide_held_[rows.at + static_cast<std::size_t>(k)]);
        }
        for (int k = 8 + modes; k < rows.width; ++k) y[k] = start[k] = 0;
        y[6] = y[7] = start[6] = start[7] = 0;
    }
}

void IslandSolver::move_directly() {
    narrow(true);
    for (SpringRows& s : springs_) s.moved = s.impulse;
    std::fill(gradient_.begin(), gradient_.end(), 0.);
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        ContactRows& c = contacts_[i];
        c.now += static_cast<float>(h_ * seen(c, wide_y_)[0]);
        const Eigen::Vector3d& p = direct_contacts_[i].impulse;
        for (int k = 0; k < 3; ++k) {
            c.impulse[k] -= c.at_move[k];  // of the second half before
            c.at_move[k] = static_cast<float>(p[k]);
        }
        c.largest = std::max(c.largest, c.at_move[0]);
        note_work(c, c.at_move[0]);
        const Eigen::Vector3d kept(c.at_move[0], c.at_move[1], c.at_move[2]);
        if (!kept.isZero(0)) apply(c, in_world(c, kept), place_now(c), outside_);
        give(c, p, gradient_);
    }
    auto along = [](const Eigen::Vector3d& p) {
        return std::array<float, 3>{float(p[0]), float(p[1]), float(p[2])};
    };
    for (SpringRows& s : springs_) {
        const auto p = along(s.moved);
        const Eigen::Vector3d moved = in_world(s, s.moved);
        if (s.told) tell(s, -1, moved, {p[0], p[1], p[2]}, s.place);
        apply(s, moved, s.place, outside_);
        give(s, s.moved, gradient_);
    }
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        WorldBodyState& s = rows_of_[i].body->state;
        s.position += h_ * s.velocity;
        s.orientation = ends_[i].orientation;
    }
    for (const BodyRows& rows : rows_of_)
        for (std::size_t k = 6; k < 6 + static_cast<std::size_t>(rows.body->kind->modes); ++k)
            wide_held_[rows.at + k] = gradient_[rows.at + k] / mode_scale(true);
}

void IslandSolver::solve_velocities() {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        const ContactRows& c = contacts_[i];
        const Eigen::Vector3d so_far = direct_contacts_[i].impulse;
        Eigen::Vector3d guess =
            so_far + h_ / last_h_ * Eigen::Vector3d(c.impulse[0], c.impulse[1], c.impulse[2]);
        guess[0] = std::max(guess[0], 0.);
        // What may rebound keeps its speed until it meets.
        const double allowed = c.restitution > 0 && is_rigid(c) ? kFree : c.now / h_;
        begin_contact(i, so_far, guess, c.now > 0 ? allowed : 0, false);
    }
    for (SpringRows& s : springs_) {
        set_firmness(s, false), s.offset.setZero();
        if (s.resolved) give(s, s.moved, wide_start_);
    }
    wide_y_ = wide_start_;
    for (const SpringRows& s : springs_)
        if (!s.resolved) give(s, s.moved, wide_y_);
    settle_contacts();
    for (SpringRows& s : springs_)
        if (s.resolved) s.impulse = s.moved;
}

void IslandSolver::finish_directly(bool last) {
    narrow(false);
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
        ContactRows& c = contacts_[i];
        for (int k = 0; k < 3; ++k) c.impulse[k] = static_cast<float>(direct_contacts_[i].impulse[k]);
        c.largest = std::max(c.largest, c.impulse[0]);
    }
    for (ContactRows& c : contacts_) note_work(c, c.impulse[0] - c.at_move[0]);
    for (ContactRows& c : contacts_)
        if (last) restitute(c);
    for (const ContactRows& c : contacts_) {
        const Eigen::Vector3d p(c.impulse[0], c.impulse[1], c.impulse[2]),
            at_move(c.at_move[0], c.at_move[1], c.at_move[2]);
        if (p.isZero(0) && at_move.isZero(0)) continue;
        if (c.told) tell(c, c.pair, in_world(c, p), c.impulse, place_now(c));
        apply(c, in_world(c, p - at_move), place_now(c), outside_);
    }
    for (SpringRows& s : springs_) {
        const float p[3] = {float(s.impulse[0]), float(s.impulse[1]), float(s.impulse[2])};
        if (s.told) tell(s, -1, in_world(s, s.impulse), p, s.place);
        apply(s, in_world(s, s.impulse), s.place, outside_);
    }
    for (const BodyRows& rows : rows_of_) {
        MovingBody& body = *rows.body;
        const Eigen::Vector3d entered = body.state.velocity;
        body.state.velocity *= of_substep(*body.kind).drag;
        body.state.angular_momentum *= of_substep(*body.kind).drag;
        if (body.own) outside_ += body.kind->mass.mass * (body.state.velocity - entered);
        limited_ += step_modes(rows);
    }
}

// Whether all act as forces may, held over a substep: h^2 k / m, and the share of their ends' speed that damping takes.
bool IslandSolver::springs_are_soft() {
    return std::ranges::all_of(springs_, [this](SpringRows& s) {
        write_spring(s);
        const double w = h_ * h_ * s.constraint->definition.stiffness * mobility_of(s);
        return w <= kSoftSpring && 2 * s.constraint->definition.damping_ratio * std::sqrt(w) <= kMostDamped;
    });
}

// Their forces where nothing holds, over half of a substep: once before the bodies move, once after, before what contacts
// do to velocities (velocity Verlet).
void IslandSolver::pull_springs() {
    const double half = h_ / 2;
    for (SpringRows& s : springs_) {
        write_spring(s);
        const PointConstraint& held = s.constraint->definition;
        const double own = mobility_of(s);
        float v[3];
        speeds(s, v);
        const Eigen::Vector3d speed(v[0], v[1], v[2]);
        s.moved = s.impulse;  // both halves: of a substep
        s.impulse = -half * held.stiffness * s.gap -
                    2 * held.damping_ratio * half * std::sqrt(held.stiffness / own) * speed;
        const float p[3] = {float(s.impulse[0]), float(s.impulse[1]), float(s.impulse[2])};
        push_by(s, p);
        const Eigen::Vector3d impulse = in_world(s, s.impulse);
        if (s.told) tell(s, -1, impulse, p, s.place);
        apply(s, impulse, s.place, outside_);
    }
}

// How far a unit of impulse lets a spring's ends move, and change their speed.
//
// A spring's force acts half before and half after the bodies move. With w = h^2 k / m of the bodies' mass there: what
// the substep resolves (w up to kResolved) by the trapezoidal rule, which keeps a spring's energy: each half is
//   1/2 h (k (C0 + C1) / 2 + c (C1 - C0) / h),  C0, C1: the ends' gap before and after;
// what is stiffer holds: the first half is 1/2 h k C1, the second takes all speed between the ends.
void IslandSolver::set_firmness(SpringRows& s, bool positions) const {
    const PointConstraint& held = s.constraint->definition;
    const double own = mobility_of(s), k = held.stiffness;
    const double w = h_ * h_ * k * own;
    if (!std::isfinite(w)) {
        s.resolved = false, s.lag = 0, s.gamma = kFirm * own;
        return;
    }
    const double loss = 2 * held.damping_ratio / std::sqrt(w);
    s.resolved = w <= kResolved;
    s.lag = s.resolved ? (0.5 - loss) / (0.5 + loss) : 0;
    const double yields = positions    ? 2 / w / (s.resolved ? 0.5 + loss : 1)
                          : s.resolved ? std::numeric_limits<double>::infinity()
                                       : 0;
    s.gamma = own * std::max(yields, kFirm);
}

// A substep, or two of half its length where the springs' ends turn too far for one, or something rebounds late in it.
void IslandSolver::direct_substep(int level, bool last) {
    level_ = level;
    h_ = settings_->dt / settings_->substeps / (1 << level);
    for (BodyRows& rows : rows_of_) rows.rotation = FreeRotation(rows.body->kind->mass.inertia, h_);
    const bool is_short = (falls_little() || level >= kMostFallLevel) &&
                          (!follow_ || moves_little() || level >= kMostFollowLevel) && strike_at_start();
    if ((is_short && try_substep(last)) || level + 1 == kSubstepLevels) return;
    remaining_ += h_ / 2;
    direct_substep(level + 1, false);
    remaining_ -= settings_->dt / settings_->substeps / (2 << level);
    direct_substep(level + 1, last);
}

// What bodies do in this substep, of their paths.
void IslandSolver::write_legs() {
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        const WorldBodyState& s = rows_of_[i].body->state;
        (*paths_)[static_cast<std::size_t>(rows_of_[i].body - bodies_->data())].legs.push_back(
            {.start = time_,
             .position = s.position,
             .orientation = s.orientation,
             .velocity = (ends_[i].position - s.position) / h_,
             .momentum = ends_[i].momentum});
    }
}

// Whether weight moves no body by more than a small share of its size in a substep: stacks sway in longer ones.
bool IslandSolver::falls_little() const {
    const double fall = h_ * h_ * settings_->gravity.norm();
    return contacts_.empty() || std::ranges::all_of(rows_of_, [fall](const BodyRows& rows) {
               return fall <= 2 * kMostFall * rows.body->kind->half_box.minCoeff();
           });
}

// False: nothing has been done, for the substep is too long.
bool IslandSolver::try_substep(bool last) {
    std::fill(wide_held_.begin(), wide_held_.end(), 0.);
    for (BodyRows& rows : rows_of_) rows.place = rows.body->state.position;
    set_forces();
    follow(true);
    load_wide(true);
    for (ContactRows& c : contacts_) {
        if (fresh_) {
            c.now = c.separation;
            for (int k = 0; k < 3; ++k) c.at_move[k] = c.impulse[k] / 2;  // at rest
        }
        // An impact begins where the bodies touch.
        if (c.starts >= time_ && c.starts < time_ + h_) c.now = std::max(c.now, 0.f);
        if (c.restitution > 0 && c.largest == 0) c.approach = static_cast<float>(seen(c, wide_free_)[0]);
    }
    const bool reached = solve_positions();
    if (!reached && level_ + 1 < kSubstepLevels) return false;
    find_ends();
    kick();
    if (paths_) write_legs();
    move_directly();
    now_ += h_;
    const bool stale = !last && moved_on();
    kick();
    follow(false);
    load_wide(false);
    solve_velocities();
    finish_directly(last || stale);
    last_h_ = h_, time_ = now_, gone_ += 1. / (1 << level_), fresh_ = false;
    if (stale) find_again();
    return true;
}

}  // namespace sim
