#include "solver/impacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "solver/contact_kernel.h"
#include "solver/restitution.h"

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// [smaller half extent] Surfaces that turn, or slide with modes, by more in what is left of the step are no standing contact after
// the impact. Without: a spinning box is held by a plane that its corner has long left.
constexpr double kStandsStill = 0.1;
// [smaller half extent] Gap of what takes part in an impact of others. Without: rounding parts a row of balls that touch.
constexpr double kTouches = 1e-3;
// Sweeps of a reflection at most, and change of impulses in one, as a share, at which it is settled. Without: a long row costs more
// than its bodies' whole step; unsettled, momentum arrives at the wrong ball.
constexpr int kImpactSweeps = 30;
constexpr float kSettled = 1e-6f;
// Reflections of one impact. What rattles between walls would never end.
constexpr int kReflections = 200;
// Passes over a substep's impacts; of what rattles on, the rest does not rebound in this substep.
constexpr int kPasses = 8;
// Times that a substep is halved for an impact, in direct solutions. Without: a rebound acts up to a substep early.
constexpr int kStrikeLevel = 2;
// Rounding of speeds, share; and the slowest approach that is reflected, share of the impact's first. Without: bodies that part
// rebound from noise, for ever.
constexpr float kRounding = 1e-6f;
constexpr float kSlowest = 1e-4f;

double smallest_half(const BodyKind& kind) {
    return kind.definition.shape.base.semi_axes.minCoeff();
}

}  // namespace

void Impacts::begin() {
    first_contact_.clear();
    const std::size_t contacts = rows_.contacts.size();
    for (auto* list : {&striking_, &struck_}) list->reserve(contacts);
    hits_.reserve(contacts), contacts_of_.reserve(2 * contacts);
    first_contact_.reserve(rows_.bodies.size() + 1), hit_bodies_.reserve(rows_.bodies.size());
}

void Impacts::strike() {
    for (int pass = 0; pass < kPasses && find_hits(); ++pass)
        for (const Hit& hit : hits_) strike(hit);
}

bool Impacts::strike_at_start() {
    if (!rows_.any_bounce) return true;
    forces_.set();
    rows_.each_body([this](BodyRows& rows) { rows_.load_velocities(rows); });
    const double soon = rows_.settings.dt / rows_.settings.substeps / (1 << kStrikeLevel);
    for (int pass = 0; pass < kPasses && find_hits(); ++pass) {
        if (rows_.substep.level < kStrikeLevel && hits_.back().time > soon) return false;
        for (const Hit& hit : hits_) strike(hit);
    }
    return true;
}

bool Impacts::find_hits() {
    hits_.clear();
    for (const std::size_t i : rows_.impacts) {
        ContactRows& c = rows_.contacts[i];
        if (c.begins != rows_.substep.number) continue;
        const double time = c.starts - rows_.substep.begins;
        if (rows_.directly && (c.restitution == 0 || !rows_.is_rigid(c) || time >= rows_.substep.h)) continue;
        if (rows_.directly && is_elsewhere(c, std::max(time, 0.))) {
            c.starts = std::numeric_limits<double>::infinity(), c.over = true;
            continue;
        }
        // Bodies with modes take time: theirs is a contact from this substep on, which rebounds when the step ends, if
        // it may stand still until then.
        if (!rows_.is_rigid(c) && !goes_far(c)) {
            c.begins = rows_.substep.number - 1;
        } else {
            hits_.push_back({std::clamp(time, 0.0, rows_.substep.h), i});
        }
    }
    if (rows_.any_bounce)
        for (std::size_t i = 0; i < rows_.contacts.size(); ++i)
            if (const double time = meets_at(rows_.contacts[i]); time < rows_.substep.h)
                hits_.push_back({time, i});
    std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) {
        return std::tuple(a.time, a.contact) < std::tuple(b.time, b.contact);
    });
    if (!hits_.empty() && first_contact_.empty()) list_contacts();
    return !hits_.empty();
}

// Whether an impact was foreseen on other paths than the bodies took: they do not meet where it acts.
bool Impacts::is_elsewhere(const ContactRows& c, double time) const {
    if (c.side[0].body < 0 || c.side[1].body < 0) return false;
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();
    for (const RowSide& side : c.side) {
        const BodyRows& rows = rows_.bodies[static_cast<std::size_t>(side.body)];
        const bool first = &side == &c.side[0];
        const Eigen::Vector3f& arm = first ? c.point->arm_a : c.point->arm_b;
        const Eigen::Vector3d there = rows.place + arm.cast<double>() + time * rows.body->state.velocity;
        apart += first ? there : Eigen::Vector3d(-there);
    }
    return apart.norm() > kSlow * rows_.size_of(c);
}

// The contacts of each body.
void Impacts::list_contacts() {
    first_contact_.assign(rows_.bodies.size() + 1, 0);
    auto each = [this](auto visit) {
        for (std::size_t i = 0; i < rows_.contacts.size(); ++i)
            for (const RowSide& side : rows_.contacts[i].side)
                if (side.body >= 0) visit(static_cast<std::size_t>(side.body), i);
    };
    each([this](std::size_t body, std::size_t) { ++first_contact_[body + 1]; });
    for (std::size_t i = 1; i < first_contact_.size(); ++i) first_contact_[i] += first_contact_[i - 1];
    contacts_of_.resize(first_contact_.back());
    next_of_.assign(rows_.bodies.size(), 0);
    each([this](std::size_t body, std::size_t i) {
        contacts_of_[first_contact_[body] + static_cast<std::size_t>(next_of_[body]++)] = i;
    });
}

// When a contact that may rebound closes its gap, since the substep's start; infinity: not within it.
double Impacts::meets_at(const ContactRows& c) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (c.restitution == 0 || c.over || c.emerging || c.begins >= rows_.substep.number || !rows_.is_rigid(c))
        return kNever;
    float v[3];
    speeds(rows_, c, v);
    if (v[0] >= -std::max(least_bounce(rows_, c), rounding(c))) return kNever;
    double time = 0;
    for (const RowSide& side : c.side)
        if (side.body >= 0) time = std::max(time, rows_.bodies[static_cast<std::size_t>(side.body)].time);
    time += std::max(gap_at(c, time), 0.0) / -static_cast<double>(v[0]);
    return time < rows_.substep.h ? time : kNever;
}

// One impact: of a pair, and of all that touches it then.
void Impacts::strike(const Hit& hit) {
    const ContactRows& seed = rows_.contacts[hit.contact];
    const bool foreseen = seed.begins == rows_.substep.number;
    double time = foreseen ? hit.time : meets_at(seed);  // after what came before
    if (!(time <= rows_.substep.h)) return;
    for (const RowSide& side : seed.side)
        if (side.body >= 0) time = std::max(time, rows_.bodies[static_cast<std::size_t>(side.body)].time);
    rows_.any_struck = true;
    hit_bodies_.clear(), struck_.clear();
    for (const RowSide& side : seed.side)
        if (side.body >= 0) reach(side.body, time);
    float v[3];
    speeds(rows_, seed, v);
    const float least = kSlowest * std::abs(v[0]);
    for (int i = 0; i < kReflections && gather(*seed.manifold, time, least); ++i) reflect();
    for (const std::size_t i : striking_) rows_.contacts[i].striking = false;
    for (const std::size_t i : holding_) rows_.springs[i].in_impact = false;
    striking_.clear(), holding_.clear();
    for (const int body : hit_bodies_) {
        BodyRows& rows = rows_.bodies[static_cast<std::size_t>(body)];
        load_rigid(rows, rows_.substep.h);
        rows.in_impact = false;
    }
    if (foreseen) {
        const auto at = static_cast<std::size_t>(seed.side[seed.side[0].body >= 0 ? 0 : 1].body);
        for (std::size_t k = first_contact_[at]; k < first_contact_[at + 1]; ++k)
            if (ContactRows& c = rows_.contacts[contacts_of_[k]]; c.manifold == seed.manifold) end_impact(c);
    }
    for (const std::size_t i : struck_) {  // they are contacts as before
        ContactRows& c = rows_.contacts[i];
        c.in_impact = false;
        std::copy_n(c.at_move, 3, c.impulse);
        for (float& half : c.at_move) half *= 0.5f;  // directly
        c.largest = c.taken = c.approach = 0;
    }
}

// Takes a body into the impact.
void Impacts::reach(int body, double time) {
    BodyRows& rows = rows_.bodies[static_cast<std::size_t>(body)];
    if (rows.in_impact) return;
    rows.in_impact = true;
    hit_bodies_.push_back(body);
    go_to(rows, time);
    const auto at = static_cast<std::size_t>(body);
    for (std::size_t k = first_contact_[at]; k < first_contact_[at + 1]; ++k)
        rows_.write_contact(rows_.contacts[contacts_of_[k]]);
    // Joints that do not yield within a substep take part.
    for (std::size_t i = 0; rows_.directly && i < rows_.springs.size(); ++i) {
        SpringRows& s = rows_.springs[i];
        if (s.side[0].body != body && s.side[1].body != body) continue;
        for (const RowSide& side : s.side)
            if (side.body >= 0) reach(side.body, time);
        rows_.write_spring(s);
        const double yields =
            s.constraint->definition.stiffness * rows_.substep.h * rows_.substep.h * mobility_of(s);
        if (yields < 1 || std::exchange(s.in_impact, true)) continue;
        holding_.push_back(i);
    }
}

// Impulses by which the joints' ends keep their speeds.
void Impacts::hold_springs() {
    for (const std::size_t i : holding_) {
        SpringRows& s = rows_.springs[i];
        float v[3];
        speeds(rows_, s, v);
        Eigen::Matrix3f k;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 3; ++column) k(row, column) = s.k[row][column];
        for (int row = 0; row < 3; ++row)
            if (k(row, row) == 0) k(row, row) = 1;  // free there
        const Eigen::Vector3f p =
            k.llt().solve(Eigen::Vector3f(s.kept[0] - v[0], s.kept[1] - v[1], s.kept[2] - v[2]));
        for (int row = 0; row < 3; ++row) s.strike[row] += p[row];
        push_by(rows_, s, {p[0], p[1], p[2]});
    }
}

// What has to be reflected together: all that approaches by more than `least`; whether there is any. Of a pair that
// does not rebound all points, so that they are left at rest together.
bool Impacts::gather(const Manifold& seed, double time, float least) {
    for (const std::size_t i : striking_) rows_.contacts[i].striking = false;
    striking_.clear();
    bool any = false;
    for (std::size_t k = 0; k < hit_bodies_.size(); ++k) {
        const auto at = static_cast<std::size_t>(hit_bodies_[k]);
        for (std::size_t j = first_contact_[at]; j < first_contact_[at + 1]; ++j) {
            ContactRows& c = rows_.contacts[contacts_of_[j]];
            if (c.striking || !touches(c, seed, time)) continue;
            // What carries load approaches by its weight, too.
            const bool carries = c.begins < 0 && c.restitution == 0;
            auto approaches = [&] {
                speeds(rows_, c, c.kept);
                return c.kept[0] < -std::max({least, carries ? 2 * least_bounce(rows_, c) : 0, rounding(c)});
            };
            bool approaching = approaches();
            if (!approaching && c.manifold->restitution > 0) continue;
            for (const RowSide& side : c.side)
                if (side.body >= 0) reach(side.body, time);
            approaching = approaches();
            if (!approaching && c.manifold->restitution > 0) continue;
            any = any || approaching;
            c.approach = c.kept[0];
            aim(rows_, c);
            c.striking = true;
            striking_.push_back(contacts_of_[j]);
        }
    }
    return any;
}

// Whether a contact may take part in an impact of a pair at a time.
bool Impacts::touches(const ContactRows& c, const Manifold& seed, double time) const {
    if (c.over || c.emerging || c.begins > rows_.substep.number) return false;
    const bool of_seed = c.manifold == &seed;
    if (of_seed && c.begins == rows_.substep.number) return c.point->gap == 0;
    if (!of_seed && (c.manifold->restitution == 0 || !rows_.is_rigid(c))) return false;
    return gap_at(c, time) <= kTouches * rows_.size_of(c);
}

// Between surfaces that go on as they move now.
double Impacts::gap_at(const ContactRows& c, double time) const {
    double gap = static_cast<double>(rows_.directly ? c.now : c.separation + c.drifted) +
                 time * static_cast<double>(c.drift[0]);
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const float* d = rows_.jacobians.data() + side.rows;
        if (!rows_.directly) gap += static_cast<double>(dot(d, rows_.moved.data() + side.y, 8));
        gap += (time - rows_.bodies[static_cast<std::size_t>(side.body)].time) *
               static_cast<double>(dot(d, rows_.y.data() + side.y, 8));
    }
    return gap;
}

// The gathered contacts' impulses, applied.
void Impacts::reflect() {
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_.bodies[static_cast<std::size_t>(body)];
        std::copy_n(rows_.y.data() + rows.offset, rows.width, rows_.kept.data() + rows.offset);
    }
    for (const std::size_t i : striking_) {
        ContactRows& c = rows_.contacts[i];
        if (std::exchange(c.in_impact, true)) continue;
        struck_.push_back(i);
        std::copy_n(c.impulse, 3, c.at_move);  // for the sweeps to come
    }
    for (const std::size_t i : holding_) speeds(rows_, rows_.springs[i], rows_.springs[i].kept);
    sweep_impact(true);
    double share = share_of_impact();
    if (!(share > 0)) {
        sweep_impact(false);
        share = share_of_impact();
    }
    const float scale = share > 0 ? static_cast<float>(share) : 0;
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_.bodies[static_cast<std::size_t>(body)];
        float *y = rows_.y.data() + rows.offset, *kept = rows_.kept.data() + rows.offset;
        for (int i = 0; i < rows.width; ++i) y[i] = kept[i] + scale * (y[i] - kept[i]);
    }
    for (const std::size_t i : striking_) {
        ContactRows& c = rows_.contacts[i];
        for (float& p : c.impulse) p *= scale;
        rows_.apply(c, c.impulse, rows_.outside);
        if (c.impulse[0] != 0 && c.restitution > 0) rows_.cross.note_rebound(c);
        std::fill_n(c.impulse, 3, 0.f);
    }
    for (const std::size_t i : holding_) {
        SpringRows& s = rows_.springs[i];
        for (float& p : s.strike) p *= scale;
        const Eigen::Vector3d p = rows_.in_world(s, {s.strike[0], s.strike[1], s.strike[2]});
        if (s.recorded) rows_.cross.record(s, -1, p, s.strike, s.place);
        rows_.apply(s, p, s.place, rows_.outside);
    }
}

void Impacts::sweep_impact(bool friction) {
    for (const int body : hit_bodies_) {
        const BodyRows& rows = rows_.bodies[static_cast<std::size_t>(body)];
        std::copy_n(rows_.kept.data() + rows.offset, rows.width, rows_.y.data() + rows.offset);
    }
    for (const std::size_t i : striking_) std::fill_n(rows_.contacts[i].impulse, 3, 0.f);
    for (const std::size_t i : holding_) std::fill_n(rows_.springs[i].strike, 3, 0.f);
    float change = 1, size = 0;
    for (int sweep = 0; sweep < kImpactSweeps && change > kSettled * size; ++sweep) {
        change = size = 0;
        for (const std::size_t i : striking_) {
            ContactRows& c = rows_.contacts[i];
            const float along = c.friction, slide_mass = c.slide_mass;
            if (!friction) c.friction = 0;
            c.slide_mass *= 0.5f;  // sure to settle
            const float before[3] = {c.impulse[0], c.impulse[1], c.impulse[2]};
            solve_contact(rows_, c, c.bias, 1, 0);
            for (int k = 0; k < 3; ++k)
                change += std::abs(c.impulse[k] - before[k]), size += std::abs(c.impulse[k]);
            c.friction = along, c.slide_mass = slide_mass;
        }
        hold_springs();
    }
}

// What of the impulses that were found keeps the balance of energy.
double Impacts::share_of_impact() const {
    double given = 0, rigid = 0, modes = 0, returned = 0;
    bool smooth = true;
    for (const std::size_t i : striking_) {
        const ContactRows& c = rows_.contacts[i];
        float v[3];
        speeds(rows_, c, v);
        for (int k = 0; k < 3; ++k) {
            const auto p = static_cast<double>(c.impulse[k]);
            given += p * static_cast<double>(c.kept[k]);
            rigid += p * (static_cast<double>(v[k]) - static_cast<double>(c.kept[k]));
        }
        returned += static_cast<double>(c.impulse[0]) * static_cast<double>(c.bias);
        smooth = smooth && rows_.is_rigid(c) && c.impulse[1] == 0 && c.impulse[2] == 0;
        for (const RowSide& side : c.side)
            for (int k = 0; side.body >= 0 && k < 3; ++k)
                for (int j = 8; j < side.width; ++j) {
                    const std::uint32_t at = side.y + static_cast<std::uint32_t>(j);
                    const double push = static_cast<double>(
                        c.impulse[k] *
                        rows_.jacobians.data()[side.rows + static_cast<std::uint32_t>(k * side.width + j)]);
                    modes += push * static_cast<double>(rows_.y.data()[at] - rows_.kept.data()[at]);
                    given += push * static_cast<double>(rows_.kept.data()[at] - rows_.start.data()[at]);
                }
    }
    for (const std::size_t i : holding_) {
        const SpringRows& s = rows_.springs[i];
        float v[3];
        speeds(rows_, s, v);
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
void Impacts::go_to(BodyRows& rows, double time) {
    MovingBody& body = *rows.body;
    WorldBodyState& s = body.state;
    const float* y = rows_.y.data() + rows.offset;
    const double gone = rows_.directly ? 0 : time - rows.time;
    if (gone > 0) {
        const Eigen::Vector3d velocity = s.velocity + rows_.velocity_given(body, rows_.substep.h),
                              momentum = s.angular_momentum + rows_.momentum_given(body, rows_.substep.h);
        rows_.write_leg(rows, velocity, momentum);
        for (int i = 0; i < 6; ++i)
            rows_.moved.data()[rows.offset + static_cast<std::uint32_t>(i)] +=
                static_cast<float>(gone) * y[i];
        rows.place += gone * velocity;
        rows.time = time;
        s.orientation = rotate_freely(s.orientation, momentum, body.kind->mass.inertia, gone);
    }
    rows_.turn_frame(rows, s.orientation.toRotationMatrix());
    load_rigid(rows, rows_.directly ? 0 : time);
}

// Its speeds after so much of the substep's gravity and forces [s].
void Impacts::load_rigid(BodyRows& rows, double gone) {
    const MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    float *y = rows_.y.data() + rows.offset, *start = rows_.start.data() + rows.offset;
    const Eigen::Vector3d velocity = body.state.velocity + rows_.velocity_given(body, gone),
                          spin = rows.frame.transpose() *
                                 spin_of(body, body.state.orientation,
                                         body.state.angular_momentum + rows_.momentum_given(body, gone));
    for (int i = 0; i < 3; ++i) {
        y[i] = start[i] = static_cast<float>(kind.root_mass * velocity[i]);
        y[3 + i] = start[3 + i] = static_cast<float>(kind.root_inertia[i] * spin[i]);
    }
}

void Impacts::stretch_gap(ContactRows& c) const {
    double gone = 0;
    for (const RowSide& side : c.side)
        if (side.body >= 0) gone = std::max(gone, rows_.bodies[static_cast<std::size_t>(side.body)].time);
    c.now += static_cast<float>(gone) * c.drift[0];
    if (gone > 0 && c.now > 0)
        c.now *=
            static_cast<float>(rows_.substep.h / std::max(rows_.substep.h - gone, 1e-6 * rows_.substep.h));
}

// Of speeds along a contact, in single precision [m/s].
float Impacts::rounding(const ContactRows& c) const {
    float sum = 0;
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const float *d = rows_.jacobians.data() + side.rows, *y = rows_.y.data() + side.y;
        sum += std::sqrt(dot(d, d, 8) * dot(y, y, 8));
    }
    return kRounding * sum;
}

// A foreseen impact is over; no guess for the substeps to come.
void Impacts::end_impact(ContactRows& c) {
    if (c.begins != rows_.substep.number) return;
    c.begins = rows_.substep.number - 1;
    if (rows_.directly) {
        c.starts = std::min(c.starts, rows_.substep.begins);
        return;
    }
    c.over = goes_far(c);
    const float time = static_cast<float>(c.starts - rows_.substep.begins);
    c.separation = c.point->gap - c.drifted - time * c.drift[0];  // with the way so far
    for (const RowSide& side : c.side)
        if (side.body >= 0)
            c.separation -= dot(rows_.jacobians.data() + side.rows, rows_.moved.data() + side.y, side.width);
    // One of bodies that ring is told from a new one.
    if (rows_.substep.number + 1 == rows_.settings.substeps && !rows_.is_rigid(c))
        c.impulse[0] = c.at_move[0] = 1e-20f;
}

// Whether an impact's bodies move too far in what is left of the step for a contact that stands still.
bool Impacts::goes_far(const ContactRows& c) const {
    double way = 0, size = 1e300;
    float v[3];
    speeds(rows_, c, v);
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const BodyKind& kind = *rows_.bodies[static_cast<std::size_t>(side.body)].body->kind;
        const float* y = rows_.y.data() + side.y;
        const double angle = Eigen::Vector3d(y[3], y[4], y[5]).cwiseQuotient(kind.root_inertia).norm() *
                             (rows_.substep.remaining + rows_.substep.h);
        way += angle * angle / 2 * turn_reach_of(kind);
        size = std::min(size, smallest_half(kind));
    }
    if (!rows_.is_rigid(c))
        way += static_cast<double>(std::hypot(v[1], v[2])) * (rows_.substep.remaining + rows_.substep.h);
    return way > kStandsStill * size;
}

}  // namespace sim
