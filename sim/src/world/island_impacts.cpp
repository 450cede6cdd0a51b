#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "world/convex_body.h"
#include "world/island_solver.h"
#include "world/row_kernels.h"

// Impacts within a substep, see IslandSolver; frames that follow their bodies.

namespace sim {
namespace {

constexpr double kFrameTurn = 0.05;   // [rad]
constexpr double kFastestRest = 0.1;  // slower approaches may be those of what rests [m/s]
constexpr int kImpactSweeps = 30;
constexpr float kSettled = 1e-6f;  // change of impulses in a sweep, share
// Of the smaller half extent: by so much surfaces that turn may leave the straight way in what is left of the step, and those of
// bodies with modes slide.
constexpr double kStandsStill = 0.1;
constexpr double kTouches = 1e-3;   // of the smaller half extent: gap of what takes part in an impact
constexpr int kPasses = 8;          // over a substep's impacts: of what rattles the rest does not rebound
constexpr int kStrikeLevel = 2;     // so often a substep is halved for an impact, directly
constexpr int kReflections = 200;   // of an impact
constexpr float kRounding = 1e-6f;  // of speeds
constexpr float kSlowest = 1e-4f;   // approach that is reflected, of the impact's first

double smallest_half(const BodyKind& kind) {
    return kind.definition.shape.base.semi_axes.minCoeff();
}

}  // namespace

// The substep's impacts in their order, then those that they lead to.
void IslandSolver::strike() {
    for (int pass = 0; pass < kPasses && find_hits(); ++pass)
        for (const Hit& hit : hits_) strike(hit);
}

// Directly, where joints want every body at the same time, impacts of rigid bodies that rebound act when the substep begins;
// what does not rebound is stopped by its contact. False: one comes so late that the substep has to be halved first.
bool IslandSolver::strike_at_start() {
    if (!any_bounce_) return true;
    set_forces();
    each_body([this](BodyRows& rows) { load_velocities(rows); });
    const double soon = settings_->dt / settings_->substeps / (1 << kStrikeLevel);
    for (int pass = 0; pass < kPasses && find_hits(); ++pass) {
        if (level_ < kStrikeLevel && hits_.back().time > soon) return false;
        for (const Hit& hit : hits_) strike(hit);
    }
    return true;
}

bool IslandSolver::find_hits() {
    hits_.clear();
    for (const std::size_t i : impacts_) {
        ContactRows& c = contacts_[i];
        if (c.begins != substep_) continue;
        const double time = c.starts - time_;
        if (direct_ && (c.restitution == 0 || !is_rigid(c) || time >= h_)) continue;
        if (direct_ && is_elsewhere(c, std::max(time, 0.))) {
            c.starts = std::numeric_limits<double>::infinity(), c.over = true;
            continue;
        }
        // Bodies with modes take time: theirs is a contact from this substep on, which rebounds when the step ends, if
        // it may stand still until then.
        if (!is_rigid(c) && !goes_far(c)) {
            c.begins = substep_ - 1;
        } else {
            hits_.push_back({std::clamp(time, 0.0, h_), i});
        }
    }
    if (any_bounce_)
        for (std::size_t i = 0; i < contacts_.size(); ++i)
            if (const double time = meets_at(contacts_[i]); time < h_) hits_.push_back({time, i});
    std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) {
        return std::tuple(a.time, a.contact) < std::tuple(b.time, b.contact);
    });
    if (!hits_.empty() && first_contact_.empty()) list_contacts();
    return !hits_.empty();
}

// Whether an impact was foreseen on other paths than the bodies took: they do not meet where it acts.
bool IslandSolver::is_elsewhere(const ContactRows& c, double time) const {
    if (c.side[0].body < 0 || c.side[1].body < 0) return false;
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();
    for (const Side& side : c.side) {
        const BodyRows& rows = rows_of_[static_cast<std::size_t>(side.body)];
        const bool first = &side == &c.side[0];
        const Eigen::Vector3f& arm = first ? c.point->arm_a : c.point->arm_b;
        const Eigen::Vector3d there = rows.place + arm.cast<double>() + time * rows.body->state.velocity;
        apart += first ? there : Eigen::Vector3d(-there);
    }
    return apart.norm() > kSlow * size_of(c);
}

// The contacts of each body.
void IslandSolver::list_contacts() {
    first_contact_.assign(rows_of_.size() + 1, 0);
    auto each = [this](auto visit) {
        for (std::size_t i = 0; i < contacts_.size(); ++i)
            for (const Side& side : contacts_[i].side)
                if (side.body >= 0) visit(static_cast<std::size_t>(side.body), i);
    };
    each([this](std::size_t body, std::size_t) { ++first_contact_[body + 1]; });
    for (std::size_t i = 1; i < first_contact_.size(); ++i) first_contact_[i] += first_contact_[i - 1];
    contacts_of_.resize(first_contact_.back());
    next_of_.assign(rows_of_.size(), 0);
    each([this](std::size_t body, std::size_t i) {
        contacts_of_[first_contact_[body] + static_cast<std::size_t>(next_of_[body]++)] = i;
    });
}

// When a contact that may rebound closes its gap, since the substep's start; infinity: not within it.
double IslandSolver::meets_at(const ContactRows& c) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (c.restitution == 0 || c.over || c.emerging || c.begins >= substep_ || !is_rigid(c)) return kNever;
    float v[3];
    speeds(c, v);
    if (v[0] >= -std::max(least_bounce(c), rounding(c))) return kNever;
    double time = 0;
    for (const Side& side : c.side)
        if (side.body >= 0) time = std::max(time, rows_of_[static_cast<std::size_t>(side.body)].time);
    time += std::max(gap_at(c, time), 0.0) / -static_cast<double>(v[0]);
    return time < h_ ? time : kNever;
}

// One impact: of a pair, and of all that touches it then.
void IslandSolver::strike(const Hit& hit) {
    const ContactRows& seed = contacts_[hit.contact];
    const bool foreseen = seed.begins == substep_;
    double time = foreseen ? hit.time : meets_at(seed);  // after what came before
    if (!(time <= h_)) return;
    for (const Side& side : seed.side)
        if (side.body >= 0) time = std::max(time, rows_of_[static_cast<std::size_t>(side.body)].time);
    any_struck_ = true;
    hit_bodies_.clear(), struck_.clear();
    for (const Side& side : seed.side)
        if (side.body >= 0) reach(side.body, time);
    float v[3];
    speeds(seed, v);
    const float least = kSlowest * std::abs(v[0]);
    for (int i = 0; i < kReflections && gather(*seed.manifold, time, least); ++i) reflect();
    for (const std::size_t i : striking_) contacts_[i].striking = false;
    for (const std::size_t i : holding_) springs_[i].struck = false;
    striking_.clear(), holding_.clear();
    for (const int body : hit_bodies_) {
        BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
        load_rigid(rows, h_);
        rows.struck = false;
    }
    if (foreseen) {
        const auto at = static_cast<std::size_t>(seed.side[seed.side[0].body >= 0 ? 0 : 1].body);
        for (std::size_t k = first_contact_[at]; k < first_contact_[at + 1]; ++k)
            if (ContactRows& c = contacts_[contacts_of_[k]]; c.manifold == seed.manifold) end_impact(c);
    }
    for (const std::size_t i : struck_) {  // they are contacts as before
        ContactRows& c = contacts_[i];
        c.struck = false;
        std::copy_n(c.at_move, 3, c.impulse);
        for (float& half : c.at_move) half *= 0.5f;  // directly
        c.largest = c.taken = c.approach = 0;
    }
}

// Takes a body into the impact.
void IslandSolver::reach(int body, double time) {
    BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
    if (rows.struck) return;
    rows.struck = true;
    hit_bodies_.push_back(body);
    go_to(rows, time);
    const auto at = static_cast<std::size_t>(body);
    for (std::size_t k = first_contact_[at]; k < first_contact_[at + 1]; ++k)
        write_contact(contacts_[contacts_of_[k]]);
    // Joints that do not yield within a substep take part.
    for (std::size_t i = 0; direct_ && i < springs_.size(); ++i) {
        SpringRows& s = springs_[i];
        if (s.side[0].body != body && s.side[1].body != body) continue;
        for (const Side& side : s.side)
            if (side.body >= 0) reach(side.body, time);
        write_spring(s);
        const double yields = s.constraint->definition.stiffness * h_ * h_ * mobility_of(s);
        if (yields < 1 || std::exchange(s.struck, true)) continue;
        holding_.push_back(i);
    }
}

// Impulses by which the joints' ends keep their speeds.
void IslandSolver::hold_springs() {
    for (const std::size_t i : holding_) {
        SpringRows& s = springs_[i];
        float v[3];
        speeds(s, v);
        Eigen::Matrix3f k;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) k(row, column) = s.k[row][column];
        for (int row = 0; row < 3; ++row)
            if (k(row, row) == 0) k(row, row) = 1;  // free there
        const Eigen::Vector3f p =
            k.llt().solve(Eigen::Vector3f(s.kept[0] - v[0], s.kept[1] - v[1], s.kept[2] - v[2]));
        for (int row = 0; row < 3; ++row) s.strike[row] += p[row];
        push_by(s, {p[0], p[1], p[2]});
    }
}

// What has to be reflected together: all that approaches by more than `least`; whether there is any. Of a pair that
// does not rebound all points, so that they are left at rest together.
bool IslandSolver::gather(const Manifold& seed, double time, float least) {
    for (const std::size_t i : striking_) contacts_[i].striking = false;
    striking_.clear();
    bool any = false;
    for (std::size_t k = 0; k < hit_bodies_.size(); ++k) {
        const auto at = static_cast<std::size_t>(hit_bodies_[k]);
        for (std::size_t j = first_contact_[at]; j < first_contact_[at + 1]; ++j) {
            ContactRows& c = contacts_[contacts_of_[j]];
            if (c.striking || !touches(c, seed, time)) continue;
            // What carries load approaches by its weight, too.
            const bool carries = c.begins < 0 && c.restitution == 0;
            auto approaches = [&] {
                speeds(c, c.kept);
                return c.kept[0] < -std::max({least, carries ? 2 * least_bounce(c) : 0, rounding(c)});
            };
            bool approaching = approaches();
            if (!approaching && c.manifold->restitution > 0) continue;
            for (const Side& side : c.side)
                if (side.body >= 0) reach(side.body, time);
            approaching = approaches();
            if (!approaching && c.manifold->restitution > 0) continue;
            any = any || approaching;
            c.approach = c.kept[0];
            aim(c);
            c.striking = true;
            striking_.push_back(contacts_of_[j]);
        }
    }
    return any;
}

// Whether a contact may take part in an impact of a pair at a time.
bool IslandSolver::touches(const ContactRows& c, const Manifold& seed, double time) const {
    if (c.over || c.emerging || c.begins > substep_) return false;
    const bool of_seed = c.manifold == &seed;
    if (of_seed && c.begins == substep_) return c.point->gap == 0;
    if (!of_seed && (c.manifold->restitution == 0 || !is_rigid(c))) return false;
    return gap_at(c, time) <= kTouches * size_of(c);
}

// Between surfaces that go on as they move now.
double IslandSolver::gap_at(const ContactRows& c, double time) const {
    double gap = static_cast<double>(direct_ ? c.now : c.separation + c.drifted) +
                 time * static_cast<double>(c.drift[0]);
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const float* d = jacobians_.data() + side.rows;
        if (!direct_) gap += static_cast<double>(dot(d, moved_.data() + side.y, 8));
        gap += (time - rows_of_[static_cast<std::size_t>(side.body)].time) *
               static_cast<double>(dot(d, y_.data() + side.y, 8));
    }
    return gap;
}

// The gathered contacts' impulses, applied.
void IslandSolver::reflect() {
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
        std::copy_n(y_.data() + rows.offset, rows.width, kept_.data() + rows.offset);
    }
    for (const std::size_t i : striking_) {
        ContactRows& c = contacts_[i];
        if (std::exchange(c.struck, true)) continue;
        struck_.push_back(i);
        std::copy_n(c.impulse, 3, c.at_move);  // for the sweeps to come
    }
    for (const std::size_t i : holding_) speeds(springs_[i], springs_[i].kept);
    sweep_impact(true);
    double share = share_of_impact();
    if (!(share > 0)) {
        sweep_impact(false);
        share = share_of_impact();
    }
    const float scale = share > 0 ? static_cast<float>(share) : 0;
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
        float *y = y_.data() + rows.offset, *kept = kept_.data() + rows.offset;
        for (int i = 0; i < rows.width; ++i) y[i] = kept[i] + scale * (y[i] - kept[i]);
    }
    for (const std::size_t i : striking_) {
        ContactRows& c = contacts_[i];
        for (float& p : c.impulse) p *= scale;
        apply(c, c.impulse, outside_);
        if (c.pair >= 0 && c.impulse[0] != 0 && c.restitution > 0)
            crossed_[static_cast<std::size_t>(c.pair)].blow = true;
        std::fill_n(c.impulse, 3, 0.f);
    }
    for (const std::size_t i : holding_) {
        SpringRows& s = springs_[i];
        for (float& p : s.strike) p *= scale;
        const Eigen::Vector3d p = in_world(s, {s.strike[0], s.strike[1], s.strike[2]});
        if (s.told) tell(s, -1, p, s.strike, s.place);
        apply(s, p, s.place, outside_);
    }
}

void IslandSolver::sweep_impact(bool friction) {
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_of_[static_cast<std::size_t>(body)];
        std::copy_n(kept_.data() + rows.offset, rows.width, y_.data() + rows.offset);
    }
    for (const std::size_t i : striking_) std::fill_n(contacts_[i].impulse, 3, 0.f);
    for (const std::size_t i : holding_) std::fill_n(springs_[i].strike, 3, 0.f);
    float change = 1, size = 0;
    for (int sweep = 0; sweep < kImpactSweeps && change > kSettled * size; ++sweep) {
        change = size = 0;
        for (const std::size_t i : striking_) {
            ContactRows& c = contacts_[i];
            const float along = c.friction, slide_mass = c.slide_mass;
            if (!friction) c.friction = 0;
            c.slide_mass *= 0.5f;  // sure to settle
            const float before[3] = {c.impulse[0], c.impulse[1], c.impulse[2]};
            solve_contact(c, Push::none);
            for (int k = 0; k < 3; ++k)
                change += std::abs(c.impulse[k] - before[k]), size += std::abs(c.impulse[k]);
            c.friction = along, c.slide_mass = slide_mass;
        }
        hold_springs();
    }
}

// What of the impulses that were found keeps the balance of energy; see IslandSolver.
double IslandSolver::share_of_impact() const {
    double given = 0, rigid = 0, modes = 0, returned = 0;
    bool smooth = true;
    for (const std::size_t i : striking_) {
        const ContactRows& c = contacts_[i];
        float v[3];
        speeds(c, v);
        for (int k = 0; k < 3; ++k) {
            const auto p = static_cast<double>(c.impulse[k]);
            given += p * static_cast<double>(c.kept[k]);
            rigid += p * (static_cast<double>(v[k]) - static_cast<double>(c.kept[k]));
        }
        returned += static_cast<double>(c.impulse[0]) * static_cast<double>(c.bias);
        smooth = smooth && is_rigid(c) && c.impulse[1] == 0 && c.impulse[2] == 0;
        for (const Side& side : c.side)
            for (int k = 0; side.body >= 0 && k < 3; ++k)
                for (int j = 8; j < side.width; ++j) {
                    const std::uint32_t at = side.y + static_cast<std::uint32_t>(j);
                    const double push = static_cast<double>(
                        c.impulse[k] *
                        jacobians_.data()[side.rows + static_cast<std::uint32_t>(k * side.width + j)]);
                    modes += push * static_cast<double>(y_.data()[at] - kept_.data()[at]);
                    given += push * static_cast<double>(kept_.data()[at] - start_.data()[at]);
                }
    }
    for (const std::size_t i : holding_) {
        const SpringRows& s = springs_[i];
        float v[3];
        speeds(s, v);
        for (int k = 0; k < 3; ++k) {
            given += static_cast<double>(s.strike[k] * s.kept[k]);
            rigid += static_cast<double>(s.strike[k] * (v[k] - s.kept[k]));
        }
    }
    rigid -= modes;
    // Of joints that are not solved exactly the part has either sign: no share gives energy.
    return smooth ? std::min({2.0, -(given + returned) / rigid, -2 * given / rigid})
                  : std::min(1.0, -given / (rigid / 2 + modes));
}

// Takes a body to a time of the substep with the velocities that it has; its speeds are those that it has there.
void IslandSolver::go_to(BodyRows& rows, double time) {
    MovingBody& body = *rows.body;
    WorldBodyState& s = body.state;
    const float* y = y_.data() + rows.offset;
    const double gone = direct_ ? 0 : time - rows.time;
    if (gone > 0) {
        const Eigen::Vector3d velocity = s.velocity + velocity_given(body, h_),
                              momentum = s.angular_momentum + momentum_given(body, h_);
        if (paths_) write_leg(rows, velocity, momentum);
        for (int i = 0; i < 6; ++i)
            moved_.data()[rows.offset + static_cast<std::uint32_t>(i)] += static_cast<float>(gone) * y[i];
        rows.place += gone * velocity;
        rows.time = time;
        s.orientation = rotate_freely(s.orientation, momentum, body.kind->mass.inertia, gone);
    }
    turn_frame(rows, s.orientation.toRotationMatrix());
    load_rigid(rows, direct_ ? 0 : time);
}

// Its speeds after so much of the substep's gravity and forces [s].
void IslandSolver::load_rigid(BodyRows& rows, double gone) {
    const MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    float *y = y_.data() + rows.offset, *start = start_.data() + rows.offset;
    const Eigen::Vector3d velocity = body.state.velocity + velocity_given(body, gone),
                          spin = rows.frame.transpose() *
                                 spin_of(body, body.state.orientation,
                                         body.state.angular_momentum + momentum_given(body, gone));
    for (int i = 0; i < 3; ++i) {
        y[i] = start[i] = static_cast<float>(kind.root_mass * velocity[i]);
        y[3 + i] = start[3 + i] = static_cast<float>(kind.root_inertia[i] * spin[i]);
    }
}

void IslandSolver::write_leg(const BodyRows& rows, const Eigen::Vector3d& velocity,
                             const Eigen::Vector3d& momentum) {
    if (h_ - rows.time < 1e-9 * h_) return;
    (*paths_)[static_cast<std::size_t>(rows.body - bodies_->data())].legs.push_back(
        {.start = time_ + rows.time,
         .position = rows.place,
         .orientation = rows.body->state.orientation,
         .velocity = velocity,
         .momentum = momentum});
}

// Gaps of bodies that impacts took on close in what is left of the substep.
void IslandSolver::stretch_gap(ContactRows& c) const {
    double gone = 0;
    for (const Side& side : c.side)
        if (side.body >= 0) gone = std::max(gone, rows_of_[static_cast<std::size_t>(side.body)].time);
    c.now += static_cast<float>(gone) * c.drift[0];
    if (gone > 0 && c.now > 0) c.now *= static_cast<float>(h_ / std::max(h_ - gone, 1e-6 * h_));
}

// Frames follow bodies that turned, with what is written in them: rows, and the way so far. Rows of contacts that rebound
// follow the place where they act, too.
void IslandSolver::turn_frames(const IslandBlocks::Block& slab) {
    for (const std::uint32_t body : blocks_.bodies_of(slab.slab)) {
        BodyRows& rows = rows_of_[body];
        rows.turned = false;
        const Eigen::Vector3d& root = rows.body->kind->root_inertia;
        if (root.maxCoeff() - root.minCoeff() < 1e-6 * root.maxCoeff()) continue;  // alike in all frames
        const Eigen::Matrix3d now = rows.body->state.orientation.toRotationMatrix();
        if ((now - rows.frame).squaredNorm() < 2 * kFrameTurn * kFrameTurn) continue;
        rows.turned = true;
        turn_frame(rows, now);
    }
}

void IslandSolver::turn_rows(const IslandBlocks::Block& block) {
    auto has_turned = [this](const Side& side) {
        return side.body >= 0 && rows_of_[static_cast<std::size_t>(side.body)].turned;
    };
    for (ContactRows& c : contacts_in(block))
        if (follows(c) || has_turned(c.side[0]) || has_turned(c.side[1])) write_contact(c);
}

void IslandSolver::turn_frame(BodyRows& rows, const Eigen::Matrix3d& frame) {
    const Eigen::Vector3d& root = rows.body->kind->root_inertia;
    float* moved = moved_.data() + rows.offset + 3;
    const Eigen::Vector3d way =
        rows.frame * Eigen::Vector3d(moved[0], moved[1], moved[2]).cwiseQuotient(root);
    rows.frame = frame;
    rows.body_from_world = frame.transpose().cast<float>();
    const Eigen::Vector3d again = (frame.transpose() * way).cwiseProduct(root);
    for (int k = 0; k < 3; ++k) moved[k] = static_cast<float>(again[k]);
}

// Approaches up to this one do not rebound: those that weight brings about within a few substeps [m/s].
float IslandSolver::least_bounce(const ContactRows& c) const {
    const Eigen::Vector3d& g = settings_->gravity;
    const double h = settings_->dt / settings_->substeps,
                 along = std::abs(g.dot(c.point->normal.cast<double>())) + 0.1 * g.norm();
    return static_cast<float>(std::min(kFastestRest, 4 * h * along));
}

// Of speeds along a contact, in single precision [m/s].
float IslandSolver::rounding(const ContactRows& c) const {
    float sum = 0;
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const float *d = jacobians_.data() + side.rows, *y = y_.data() + side.y;
        sum += std::sqrt(dot(d, d, 8) * dot(y, y, 8));
    }
    return kRounding * sum;
}

// The speed that an impact leaves: e times the approach; of bodies with modes, what leaves e^2 of the energy that stopping
// them takes, K / 2 of the rigid part for a unit of impulse.
void IslandSolver::aim(ContactRows& c) const {
    c.bias = 0;
    const float e = c.approach < -least_bounce(c) ? c.manifold->restitution : 0;
    if (e == 0) return;
    float rigid = 0;
    for (const Side& side : c.side)
        if (side.body >= 0) rigid += dot(jacobians_.data() + side.rows, jacobians_.data() + side.rows, 8);
    const float whole = std::max(c.k[0][0], rigid), firm = 2 * whole - rigid;
    c.bias = c.approach * ((whole + std::sqrt(whole * whole - firm * rigid * (1 - e * e))) / firm - 1);
}

// A foreseen impact is over; no guess for the substeps to come.
void IslandSolver::end_impact(ContactRows& c) {
    if (c.begins != substep_) return;
    c.begins = substep_ - 1;
    if (direct_) {
        c.starts = std::min(c.starts, time_);
        return;
    }
    c.over = goes_far(c);
    const float time = static_cast<float>(c.starts - time_);
    c.separation = c.point->gap - c.drifted - time * c.drift[0];  // with the way so far
    for (const Side& side : c.side)
        if (side.body >= 0)
            c.separation -= dot(jacobians_.data() + side.rows, moved_.data() + side.y, side.width);
    // One of bodies that ring is told from a new one.
    if (substep_ + 1 == settings_->substeps && !is_rigid(c)) c.impulse[0] = c.at_move[0] = 1e-20f;
}

// Whether an impact's bodies move too far in what is left of the step for a contact that stands still.
bool IslandSolver::goes_far(const ContactRows& c) const {
    double way = 0, size = 1e300;
    float v[3];
    speeds(c, v);
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        const BodyKind& kind = *rows_of_[static_cast<std::size_t>(side.body)].body->kind;
        const float* y = y_.data() + side.y;
        const double angle =
            Eigen::Vector3d(y[3], y[4], y[5]).cwiseQuotient(kind.root_inertia).norm() * (remaining_ + h_);
        way += angle * angle / 2 * turn_reach_of(kind);
        size = std::min(size, smallest_half(kind));
    }
    if (!is_rigid(c)) way += static_cast<double>(std::hypot(v[1], v[2])) * (remaining_ + h_);
    return way > kStandsStill * size;
}

}  // namespace sim
