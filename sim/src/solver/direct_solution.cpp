#include "solver/direct_solution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "solver/contact_kernel.h"
#include "solver/restitution.h"

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// [multiply-adds a body] Up to which an island is solved directly: of contacts alone, where sweeps would do, and with springs.
// More: piles cost many times their sweeps.
constexpr double kMostWithContacts = 500, kMostWithSprings = 1e4;
// [bodies' mobility] Least compliance of a spring: what is called rigid. Less: the factorisation loses its digits.
constexpr double kFirm = 1e-9;
// [bodies' mobility] Compliance of an overlap over a substep at most. Less: how a load is shared out by four corners is not
// defined; more: stacks sway.
constexpr double kSoft = 3e-4;
// [smaller half extent] Overlap at which a contact carries its load of the substep before: it is harder under heavy loads.
// Without: high stacks sink.
constexpr double kOverlap = 1e-4;
// [bodies' mobility] An overlap's least compliance, well above that of springs: loads stay finite where these hold bodies inside
// each other.
constexpr double kHardest = 1e-5;
// [bodies' mobility] Compliance by which a contact's impulse is held to the round before's; along, friction's.
constexpr double kHeld = 1e-2, kHeldAlong = 0.1;
// Share of an overlap that a substep takes back. More: loads are shared out anew at every step, and stacks simmer.
constexpr double kCorrected = 0.2;
// Newton's iterations on the ends' poses; where they do not suffice the substep is halved.
constexpr int kMostTurns = 12;
// h^2 k / m of a spring up to which its motion is followed (trapezoidal rule); stiffer ones hold. More: they ring undamped.
constexpr double kResolved = 0.25;
// h^2 k / m, and share of the ends' speed that damping takes, up to which a spring is a force. More: velocity Verlet is unstable
// from 4 on, and wrong long before.
constexpr double kSoftSpring = 0.05, kMostDamped = 0.5;
// [half extent] Gap of a spring's ends that is good enough. Larger: chains of stiff springs gain energy.
constexpr double kEndTolerance = 1e-8;
// [half extent] By which weight may move a body in a substep, and how often a substep is halved for that. Without: stacks of small
// boxes sway and fall.
constexpr double kMostFall = 1.2e-3;
constexpr int kMostFallLevel = 6;
// [m/s] A speed that no contact holds.
constexpr double kFree = 1e6;
// [rad] By which a spring's arm may turn in a substep: its energy is off by t^2 / 12 of itself. More: pendulums gain.
constexpr double kMostTurn = 0.04;

// Over the first half of a substep's impulses modes yield as they will to the whole, that is to twice as much.
double mode_scale(bool positions) noexcept {
    return positions ? std::numbers::sqrt2 : 1;
}

}  // namespace

void DirectSolution::begin_step() {
    springs_soft_ = std::ranges::all_of(rows_.springs, [this](SpringRows& s) { return acts_as_force(s); });
    fresh_ = true;
}

bool DirectSolution::begin(double most, bool must) {
    if (!newton_.begin(most, must, springs_soft_)) return false;
    rows_.directly = true;
    ends_.resize(rows_.bodies.size());
    return true;
}

void DirectSolution::take_found(bool any) {
    fresh_ = true;
    if (!any) return;
    impacts_.begin();
    (void)begin(rows_.springs.empty() ? std::numeric_limits<double>::infinity() : most_with_springs(), true);
}

double DirectSolution::most_with_contacts() const noexcept {
    return kMostWithContacts * static_cast<double>(rows_.bodies.size());
}

double DirectSolution::most_with_springs() const noexcept {
    return kMostWithSprings * static_cast<double>(rows_.bodies.size());
}

// h^2 k / m is small, and the share of its ends' speed that damping takes.
bool DirectSolution::acts_as_force(SpringRows& s) {
    rows_.write_spring(s);
    const double h = rows_.substep.h, w = h * h * s.constraint->definition.stiffness * mobility_of(s);
    return w <= kSoftSpring && 2 * s.constraint->definition.damping_ratio * std::sqrt(w) <= kMostDamped;
}

void DirectSolution::substep(int level, bool last, bool followed) {
    Substep& now = rows_.substep;
    now.level = level;
    now.h = rows_.whole_substep() / (1 << level);
    for (BodyRows& body : rows_.bodies) body.rotation = FreeRotation(body.body->kind->mass.inertia, now.h);
    const bool is_short = (falls_little() || level >= kMostFallLevel) &&
                          (!followed || found_.moves_little() || level >= kMostFollowLevel) &&
                          impacts_.strike_at_start();
    if ((is_short && try_substep(last)) || level + 1 == kSubstepLevels) return;
    now.remaining += now.h / 2;
    substep(level + 1, false, followed);
    now.remaining -= rows_.whole_substep() / (2 << level);
    substep(level + 1, last, followed);
}

// Whether weight moves no body by more than a small share of its size in a substep: stacks sway in longer ones.
bool DirectSolution::falls_little() const {
    const double fall = rows_.substep.h * rows_.substep.h * rows_.settings.gravity.norm();
    return rows_.contacts.empty() || std::ranges::all_of(rows_.bodies, [fall](const BodyRows& rows) {
               return fall <= 2 * kMostFall * rows.body->kind->half_box.minCoeff();
           });
}

// False: nothing has been done, for the substep is too long.
bool DirectSolution::try_substep(bool last) {
    std::fill(newton_.held.begin(), newton_.held.end(), 0.);
    for (BodyRows& rows : rows_.bodies) rows.place = rows.body->state.position;
    forces_.set();
    follow_bodies(true);
    load(true);
    for (ContactRows& c : rows_.contacts) {
        if (fresh_) {
            c.now = c.separation;
            for (int k = 0; k < 3; ++k) c.at_move[k] = c.impulse[k] / 2;  // at rest
        }
        // An impact begins where the bodies touch.
        if (c.starts >= rows_.substep.begins && c.starts < rows_.substep.begins + rows_.substep.h)
            c.now = std::max(c.now, 0.f);
        if (c.restitution > 0 && c.largest == 0)
            c.approach = static_cast<float>(newton_.seen(c, newton_.free)[0]);
    }
    const bool reached = solve_positions();
    if (!reached && rows_.substep.level + 1 < kSubstepLevels) return false;
    find_ends();
    kick();
    write_legs();
    move();
    rows_.substep.now += rows_.substep.h;
    const bool stale = !last && found_.moved_on();
    kick();
    follow_bodies(false);
    load(false);
    solve_velocities();
    finish(last || stale);
    rows_.substep.last_h = rows_.substep.h, rows_.substep.begins = rows_.substep.now,
    rows_.substep.passed += 1. / (1 << rows_.substep.level), fresh_ = false;
    if (stale) take_found(found_.find_again());
    return true;
}

// Rows follow the bodies.
void DirectSolution::follow_bodies(bool positions) {
    newton_.forget_factor();
    for (BodyRows& rows : rows_.bodies) {
        rows.place = rows.body->state.position;
        rows.frame = rows.body->state.orientation.toRotationMatrix();
        rows.body_from_world = rows.frame.transpose().cast<float>();
    }
    for (SpringRows& s : rows_.springs) rows_.write_spring(s), newton_.widen(s, mode_scale(positions));
    for (ContactRows& c : rows_.contacts) rows_.write_contact(c), newton_.widen(c, mode_scale(positions));
}

// Half of the substep's gravity and forces.
void DirectSolution::kick() {
    forces_.count(0.5);
    for (const BodyRows& rows : rows_.bodies) {
        MovingBody& body = *rows.body;
        const double mass = body.kind->mass.mass;
        const Eigen::Vector3d change = rows_.substep.h / 2 * body.gravity_scale * rows_.settings.gravity;
        body.state.velocity += change;
        if (body.own) rows_.outside += mass * change;
        if (!body.pushed) continue;
        body.state.velocity += rows_.substep.h / 2 / mass * body.force;
        body.state.angular_momentum += rows_.substep.h / 2 * body.torque;
    }
}

// The bodies' velocities after a share of the substep's gravity and forces, and their modes' mean rates under
// what has been given to them.
void DirectSolution::load(bool positions) {
    const double share = positions ? 0.5 : 0, scale = 1 / mode_scale(positions);
    for (const BodyRows& rows : rows_.bodies) {
        const MovingBody& body = *rows.body;
        const BodyKind& kind = *body.kind;
        const WorldBodyState& s = body.state;
        const Eigen::Matrix3d turned = s.orientation.toRotationMatrix();
        Eigen::Vector3d velocity =
            s.velocity + share * rows_.substep.h * body.gravity_scale * rows_.settings.gravity;
        Eigen::Vector3d momentum = s.angular_momentum;
        if (body.pushed) {
            velocity += share * rows_.substep.h / kind.mass.mass * body.force;
            momentum += share * rows_.substep.h * body.torque;
        }
        const Eigen::Vector3d spin =
            rows.frame.transpose() *
            (turned * (turned.transpose() * momentum).cwiseQuotient(kind.mass.inertia));
        double* y = newton_.free.data() + rows.at;
        for (int i = 0; i < 3; ++i) {
            y[i] = kind.root_mass * velocity[i];
            y[3 + i] = kind.root_inertia[i] * spin[i];
        }
        const HeldSteps& step = rows_.of_substep(kind).held;
        for (int k = 0; k < kind.modes; ++k) {
            y[6 + k] = (step.mean_z[k] * s.q[k] + step.mean_rate[k] * s.q_dot[k]) / step.root_compliance[k] +
                       newton_.held[rows.at + 6 + static_cast<std::size_t>(k)];
            if (body.pushed) y[6 + k] += step.root_compliance[k] * rows_.substep.h * body.modal_force[k];
            y[6 + k] *= scale;
        }
    }
    newton_.start = newton_.free;
}

void DirectSolution::find_ends() {
    for (std::size_t i = 0; i < rows_.bodies.size(); ++i) {
        const BodyRows& rows = rows_.bodies[i];
        const BodyKind& kind = *rows.body->kind;
        const WorldBodyState& s = rows.body->state;
        const double *y = newton_.y.data() + rows.at, *start = newton_.free.data() + rows.at;
        Eigen::Vector3d change;
        for (int k = 0; k < 3; ++k) change[k] = kind.root_inertia[k] * (y[3 + k] - start[3 + k]);
        ends_[i].position = s.position + rows_.substep.h / kind.root_mass * Eigen::Vector3d(y[0], y[1], y[2]);
        Eigen::Vector3d momentum = s.angular_momentum + rows.frame * change;
        if (rows.body->pushed) momentum += rows_.substep.h / 2 * rows.body->torque;
        ends_[i].orientation = rows.rotation.advance(s.orientation, momentum);
        ends_[i].momentum = momentum;
    }
}

// Between a spring's ends where the substep's velocities bring them.
Eigen::Vector3d DirectSolution::gap_at_end(const SpringRows& spring) const {
    const PointConstraint& held = spring.constraint->definition;
    auto end = [this](int body, const Eigen::Vector3d& rest) -> Eigen::Vector3d {
        if (body < 0) return rest;
        const MovingBody& b = rows_.world[static_cast<std::size_t>(body)];
        if (rows_.local(body) < 0) {
            const BodyPath::Pose pose = rows_.pose_of(body, rows_.substep.begins + rows_.substep.h);
            return pose.position + pose.orientation * rest;
        }
        const auto i = static_cast<std::size_t>(rows_.local(body));
        const BodyKind& kind = *b.kind;
        Eigen::Vector3d point = rest;
        if (kind.modes > 0) {
            alignas(32) float shapes[3 * kMostModes];
            kind.shapes_at(rest.cast<float>(), shapes);
            const double* y = newton_.y.data() + rows_.bodies[i].at + 6;
            for (int k = 0; k < kind.modes; ++k) {
                const double q = b.state.q[k] + mode_scale(true) * rows_.substep.h *
                                                    rows_.of_substep(kind).held.root_compliance[k] * y[k];
                for (int axis = 0; axis < 3; ++axis)
                    point[axis] += static_cast<double>(shapes[axis * kind.mode_width + k]) * q;
            }
        }
        return ends_[i].position + ends_[i].orientation * point;
    };
    return spring.point->gap(end(held.body_a, spring.point->a), end(held.body_b, spring.point->b),
                             orientation_at_end(held.body_b));
}

Eigen::Quaterniond DirectSolution::orientation_at_end(int body) const {
    const int i = body < 0 ? -1 : rows_.local(body);
    if (body >= 0 && i < 0) return rows_.pose_of(body, rows_.substep.begins + rows_.substep.h).orientation;
    return i < 0 ? Eigen::Quaterniond::Identity() : ends_[static_cast<std::size_t>(i)].orientation;
}

// Whether no spring's arm turns further than the scheme is accurate for: the energy of a turn of t in a substep
// is off by about t^2 / 12 of itself for as long as it lasts.
bool DirectSolution::turns_little() const {
    for (const SpringRows& s : rows_.springs) {
        const PointConstraint& held = s.constraint->definition;
        for (int side = 0; side < 2; ++side) {
            if (s.side[side].body < 0) continue;
            const auto i = static_cast<std::size_t>(s.side[side].body);
            auto turns = [&](const Eigen::Vector3d& arm) {
                const Eigen::Vector3d turn = ends_[i].orientation * arm - rows_.bodies[i].frame * arm;
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

// How far a unit of impulse lets a spring's ends move, and change their speed.
//
// A spring's force acts half before and half after the bodies move. With w = h^2 k / m of the bodies' mass there: what
// the substep resolves (w up to kResolved) by the trapezoidal rule, which keeps a spring's energy: each half is
//   1/2 h (k (C0 + C1) / 2 + c (C1 - C0) / h),  C0, C1: the ends' gap before and after;
// what is stiffer holds: the first half is 1/2 h k C1, the second takes all speed between the ends.
void DirectSolution::set_firmness(SpringRows& s, bool positions) const {
    const PointConstraint& held = s.constraint->definition;
    const double own = mobility_of(s), k = held.stiffness;
    const double w = rows_.substep.h * rows_.substep.h * k * own;
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

// A contact's problem of one half: what the start has seen of it, and the speed that is wanted.
void DirectSolution::begin_contact(std::size_t i, const Eigen::Vector3d& seen_so_far,
                                   const Eigen::Vector3d& guess, double bias, bool positions) {
    const ContactRows& c = rows_.contacts[i];
    DirectContact& d = newton_.contacts[i];
    d.soft = positions;
    const double by_load =
        std::max(kHardest * c.k[0][0], kCorrected * kOverlap * rows_.size_of(c) * rows_.settings.substeps /
                                           (rows_.settings.dt * std::max(c.at_move[0], 0.f)));
    const double softest = (positions ? kSoft : kHeld) * c.k[0][0];
    d.normal_gamma = c.emerging ? softest : std::min(softest, positions ? by_load : 10 * by_load);
    d.tangent_gamma = kHeldAlong / c.slide_mass;
    d.bias = bias;
    d.active = c.starts < rows_.substep.begins + rows_.substep.h;
    d.before = d.active ? guess : Eigen::Vector3d(Eigen::Vector3d::Zero());
    d.bound = c.friction * d.before[0];
    newton_.begin_contact(i, seen_so_far);
}

// Whether the springs' ends were brought to where they belong.
bool DirectSolution::solve_positions() {
    const double whole = rows_.settings.dt / rows_.settings.substeps;
    const double scale =
        rows_.substep.h / rows_.substep.last_h;  // the impulses of the substep before, over this one
    for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
        const ContactRows& c = rows_.contacts[i];
        const double now = c.now;
        begin_contact(
            i, Eigen::Vector3d::Zero(), scale * Eigen::Vector3d(0, c.at_move[1], c.at_move[2]),
            now > 0 ? now / rows_.substep.h : std::max(kCorrected * now / whole, -double{kPushSpeed}), true);
    }
    newton_.y = newton_.start;
    for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
        const double normal = scale * static_cast<double>(rows_.contacts[i].at_move[0]);
        newton_.contacts[i].bound = static_cast<double>(rows_.contacts[i].friction) * normal;
        newton_.give(rows_.contacts[i], {normal, 0, 0}, newton_.y);
        if (newton_.with_contacts()) continue;
        newton_.contacts[i].impulse[0] = normal;
        newton_.give(rows_.contacts[i], {normal, 0, 0}, newton_.start);
    }
    for (SpringRows& s : rows_.springs) {
        set_firmness(s, true);
        newton_.give(s, scale * s.moved, newton_.y);
    }
    double before = std::numeric_limits<double>::infinity(), size = before;
    for (const SpringRows& s : rows_.springs) size = std::min(size, rows_.size_of(s));
    const double enough = kEndTolerance * size;
    const int settles = rows_.springs.empty() ? 0 : 1;  // the turn, once near the ends
    for (int turn = 0; turn <= kMostTurns; ++turn) {
        find_ends();
        double worst = 0;
        for (SpringRows& s : rows_.springs) {
            const Eigen::Vector3d gap = gap_at_end(s) + s.lag * s.gap;
            worst = std::max(worst, (gap + rows_.substep.h * s.gamma * s.impulse).norm());
            s.offset = gap / rows_.substep.h - newton_.seen(s, newton_.y);
        }
        if (turn > (rows_.contacts.empty() ? 0 : settles) && worst <= enough) return turns_little();
        if (turn == kMostTurns || !(turn < 2 || worst < 0.7 * before)) return false;
        if (turn > 0) before = worst;
        turn == settles || !newton_.with_contacts() ? newton_.settle_contacts() : newton_.minimise();
    }
    return false;
}

// rows_.y and rows_.start from a half's solution, for what is measured and put right in single precision.
void DirectSolution::narrow(bool positions) {
    const double scale = mode_scale(positions);
    for (const BodyRows& rows : rows_.bodies) {
        float *y = rows_.y.data() + rows.offset, *start = rows_.start.data() + rows.offset;
        const double *wide = newton_.y.data() + rows.at, *before = newton_.free.data() + rows.at;
        const int modes = rows.body->kind->modes;
        for (int i = 0; i < 6; ++i)
            y[i] = static_cast<float>(wide[i]), start[i] = static_cast<float>(before[i]);
        for (int k = 6; k < 6 + modes; ++k) {
            y[2 + k] = static_cast<float>(scale * wide[k]);
            start[2 + k] =
                static_cast<float>(scale * before[k] - newton_.held[rows.at + static_cast<std::size_t>(k)]);
        }
        for (int k = 8 + modes; k < rows.width; ++k) y[k] = start[k] = 0;
        y[6] = y[7] = start[6] = start[7] = 0;
    }
}

// What bodies do in this substep, of their paths.
void DirectSolution::write_legs() {
    for (std::size_t i = 0; i < rows_.bodies.size(); ++i) {
        const WorldBodyState& s = rows_.bodies[i].body->state;
        rows_.paths[static_cast<std::size_t>(rows_.bodies[i].body - rows_.world.data())].legs.push_back(
            {.start = rows_.substep.begins,
             .position = s.position,
             .orientation = s.orientation,
             .velocity = (ends_[i].position - s.position) / rows_.substep.h,
             .momentum = ends_[i].momentum});
    }
}

void DirectSolution::move() {
    narrow(true);
    for (SpringRows& s : rows_.springs) s.moved = s.impulse;
    for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
        ContactRows& c = rows_.contacts[i];
        c.now += static_cast<float>(rows_.substep.h * newton_.seen(c, newton_.y)[0]);
        const Eigen::Vector3d& p = newton_.contacts[i].impulse;
        for (int k = 0; k < 3; ++k) {
            c.impulse[k] -= c.at_move[k];  // of the second half before
            c.at_move[k] = static_cast<float>(p[k]);
        }
        c.largest = std::max(c.largest, c.at_move[0]);
        note_work(rows_, c, c.at_move[0]);
        const Eigen::Vector3d kept(c.at_move[0], c.at_move[1], c.at_move[2]);
        if (!kept.isZero(0)) rows_.apply(c, rows_.in_world(c, kept), rows_.place_now(c), rows_.outside);
    }
    auto along = [](const Eigen::Vector3d& p) {
        return std::array<float, 3>{float(p[0]), float(p[1]), float(p[2])};
    };
    for (SpringRows& s : rows_.springs) {
        const auto p = along(s.moved);
        const Eigen::Vector3d moved = rows_.in_world(s, s.moved);
        if (s.recorded) rows_.cross.record(s, -1, moved, {p[0], p[1], p[2]}, s.place);
        rows_.apply(s, moved, s.place, rows_.outside);
    }
    for (std::size_t i = 0; i < rows_.bodies.size(); ++i) {
        WorldBodyState& s = rows_.bodies[i].body->state;
        s.position += rows_.substep.h * s.velocity;
        s.orientation = ends_[i].orientation;
    }
    newton_.hold_modes(mode_scale(true));
}

void DirectSolution::solve_velocities() {
    for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
        const ContactRows& c = rows_.contacts[i];
        const Eigen::Vector3d so_far = newton_.contacts[i].impulse;
        Eigen::Vector3d guess = so_far + rows_.substep.h / rows_.substep.last_h *
                                             Eigen::Vector3d(c.impulse[0], c.impulse[1], c.impulse[2]);
        guess[0] = std::max(guess[0], 0.);
        // What may rebound keeps its speed until it meets.
        const double allowed = c.restitution > 0 && rows_.is_rigid(c) ? kFree : c.now / rows_.substep.h;
        begin_contact(i, so_far, guess, c.now > 0 ? allowed : 0, false);
    }
    for (SpringRows& s : rows_.springs) {
        set_firmness(s, false), s.offset.setZero();
        if (s.resolved) newton_.give(s, s.moved, newton_.start);
    }
    newton_.y = newton_.start;
    for (const SpringRows& s : rows_.springs)
        if (!s.resolved) newton_.give(s, s.moved, newton_.y);
    newton_.settle_contacts();
    for (SpringRows& s : rows_.springs)
        if (s.resolved) s.impulse = s.moved;
}

void DirectSolution::finish(bool last) {
    narrow(false);
    for (std::size_t i = 0; i < rows_.contacts.size(); ++i) {
        ContactRows& c = rows_.contacts[i];
        for (int k = 0; k < 3; ++k) c.impulse[k] = static_cast<float>(newton_.contacts[i].impulse[k]);
        c.largest = std::max(c.largest, c.impulse[0]);
    }
    for (ContactRows& c : rows_.contacts) note_work(rows_, c, c.impulse[0] - c.at_move[0]);
    for (ContactRows& c : rows_.contacts)
        if (last) restitute(rows_, c);
    for (const ContactRows& c : rows_.contacts) {
        const Eigen::Vector3d p(c.impulse[0], c.impulse[1], c.impulse[2]),
            at_move(c.at_move[0], c.at_move[1], c.at_move[2]);
        if (p.isZero(0) && at_move.isZero(0)) continue;
        if (c.recorded) rows_.cross.record(c, c.pair, rows_.in_world(c, p), c.impulse, rows_.place_now(c));
        rows_.apply(c, rows_.in_world(c, p - at_move), rows_.place_now(c), rows_.outside);
    }
    for (SpringRows& s : rows_.springs) {
        const float p[3] = {float(s.impulse[0]), float(s.impulse[1]), float(s.impulse[2])};
        if (s.recorded) rows_.cross.record(s, -1, rows_.in_world(s, s.impulse), p, s.place);
        rows_.apply(s, rows_.in_world(s, s.impulse), s.place, rows_.outside);
    }
    for (const BodyRows& rows : rows_.bodies) {
        MovingBody& body = *rows.body;
        const Eigen::Vector3d entered = body.state.velocity;
        body.state.velocity *= rows_.of_substep(*body.kind).drag;
        body.state.angular_momentum *= rows_.of_substep(*body.kind).drag;
        if (body.own) rows_.outside += body.kind->mass.mass * (body.state.velocity - entered);
        rows_.limited += rows_.step_modes(rows);
    }
}

}  // namespace sim
