#include <algorithm>
#include <cmath>
#include <utility>

#include "world/convex_body.h"
#include "world/island_solver.h"
#include "world/row_kernels.h"

// Impacts within a substep, see IslandSolver; frames that follow their bodies.

namespace sim {
namespace {

constexpr double kFrameTurn = 0.05;  // [rad]
constexpr int kImpactSweeps = 30;
constexpr double kStandsStill = 0.1;  // of the smaller half extent, in what is left of the step

double smallest_half(const BodyKind& kind) {
    return kind.definition.shape.base.semi_axes.minCoeff();
}

}  // namespace

// The substep's impacts in their order.
void IslandSolver::strike() {
    bool any = false;
    for (std::size_t i = 0, next; i < impacts_.size(); i = next) {
        const ContactRows& c = contacts_[impacts_[i]];
        for (next = i + 1; next < impacts_.size() && contacts_[impacts_[next]].manifold == c.manifold;
             ++next) {
        }
        if (!hits(c)) continue;
        if (!any) turned_.assign(rows_of_.size(), false);
        any = true;
        strike(i, next);
    }
    if (!any) return;
    auto has_turned = [this](const Side& side) {
        return side.body >= 0 && turned_[static_cast<std::size_t>(side.body)];
    };
    for (ContactRows& c : contacts_)
        if (!hits(c) && (has_turned(c.side[0]) || has_turned(c.side[1]))) write_contact(c);
    for (const BodyRows& rows : rows_of_)
        std::copy_n(y_.data() + rows.offset, 8, start_.data() + rows.offset);
}

// One pair's impact. Friction and Newton's rebound can give a slender body more energy than it had; then it
// goes without friction, which for one point cannot, and if need be without rebound, which never can.
void IslandSolver::strike(std::size_t first, std::size_t last) {
    const ContactRows& c = contacts_[impacts_[first]];
    // Bodies with modes take time: theirs is a contact from this substep on, which rebounds when the step ends, if
    // it may stand still until then.
    if (!is_rigid(c) && !goes_far(c)) {
        for (std::size_t i = first; i < last; ++i) contacts_[impacts_[i]].begins = substep_ - 1;
        return;
    }
    const double time = std::clamp(static_cast<double>(c.point->begins) - substep_ * h_, 0.0, h_);
    for (const Side& side : c.side) {
        if (side.body < 0) continue;
        go_to(rows_of_[static_cast<std::size_t>(side.body)], time);
        turned_[static_cast<std::size_t>(side.body)] = true;
        std::copy_n(y_.data() + side.y, side.width, kept_.data() + side.y);
    }
    for (std::size_t i = first; i < last; ++i) {
        ContactRows& contact = contacts_[impacts_[i]];
        write_contact(contact);
        contact.slide_mass *= 0.5f;  // sure to settle
        speeds(contact, contact.kept);
        contact.approach = contact.kept[0];
        aim(contact);
    }
    for (const Strike how : {Strike::rough, Strike::smooth, Strike::soft})
        if (sweep_impact(first, last, how)) break;
    for (std::size_t i = first; i < last; ++i) end_impact(contacts_[impacts_[i]]);
}

// Whether it takes energy, if anything.
bool IslandSolver::sweep_impact(std::size_t first, std::size_t last, Strike how) {
    if (how != Strike::rough)
        for (const Side& side : contacts_[impacts_[first]].side)
            if (side.body >= 0) std::copy_n(kept_.data() + side.y, side.width, y_.data() + side.y);
    for (std::size_t i = first; i < last; ++i) {
        ContactRows& c = contacts_[impacts_[i]];
        std::fill_n(c.impulse, 3, 0.f);
        c.largest = c.taken = 0;
        if (how == Strike::soft) c.bias = std::max(c.bias, 0.f);
    }
    for (int sweep = 0; sweep < kImpactSweeps; ++sweep)
        for (std::size_t i = first; i < last; ++i) {
            ContactRows& c = contacts_[impacts_[i]];
            const float friction = c.friction;
            if (how != Strike::rough) c.friction = 0;
            solve_contact(c, Push::none);
            c.friction = friction;
        }
    if (how != Strike::soft)
        for (std::size_t i = first; i < last; ++i) rebound(contacts_[impacts_[i]]);
    float work = 0, size = 0;
    for (std::size_t i = first; i < last; ++i) {
        const ContactRows& c = contacts_[impacts_[i]];
        float v[3];
        speeds(c, v);
        for (int k = 0; k < 3; ++k) {
            work += c.impulse[k] * (c.kept[k] + v[k]) / 2;
            size += std::abs(c.impulse[k] * c.kept[k]);
        }
    }
    return work <= 1e-4f * size;
}

// Takes a body to a time of the substep with the velocities that it has.
void IslandSolver::go_to(BodyRows& rows, double time) {
    MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    WorldBodyState& s = body.state;
    float *y = y_.data() + rows.offset, *start = start_.data() + rows.offset;
    const double gone = time - rows.time;
    Eigen::Vector3d velocity = s.velocity + h_ * body.gravity_scale * settings_->gravity;
    Eigen::Vector3d momentum = s.angular_momentum;
    if (body.pushed) {
        velocity += h_ / kind.mass.mass * body.force;
        momentum += h_ * body.torque;
    }
    if (gone > 0) {
        if (paths_) write_leg(rows, velocity, momentum);
        for (int i = 0; i < 6; ++i)
            moved_.data()[rows.offset + static_cast<std::uint32_t>(i)] += static_cast<float>(gone) * y[i];
        rows.place += gone * velocity;
        rows.time = time;
        s.orientation = turned_freely(s.orientation, momentum, kind.mass.inertia, gone);
    }
    turn_frame(rows, s.orientation.toRotationMatrix());
    const Eigen::Vector3d spin = rows.frame.transpose() * spin_of(body, s.orientation, momentum);
    for (int i = 0; i < 3; ++i) {
        y[i] = start[i] = static_cast<float>(kind.root_mass * velocity[i]);
        y[3 + i] = start[3 + i] = static_cast<float>(kind.root_inertia[i] * spin[i]);
    }
}

void IslandSolver::write_leg(const BodyRows& rows, const Eigen::Vector3d& velocity,
                             const Eigen::Vector3d& momentum) {
    if (h_ - rows.time < 1e-9 * h_) return;
    (*paths_)[static_cast<std::size_t>(rows.body - bodies_->data())].legs.push_back(
        {.start = substep_ * h_ + rows.time,
         .position = rows.place,
         .orientation = rows.body->state.orientation,
         .velocity = velocity,
         .momentum = momentum});
}

// Frames follow bodies that turned, with what is written in them: rows, and the way so far.
void IslandSolver::turn_frames() {
    turned_.assign(rows_of_.size(), false);
    bool any = false;
    for (std::size_t i = 0; i < rows_of_.size(); ++i) {
        BodyRows& rows = rows_of_[i];
        const Eigen::Vector3d& root = rows.body->kind->root_inertia;
        if (root.maxCoeff() - root.minCoeff() < 1e-6 * root.maxCoeff()) continue;  // alike in all frames
        const Eigen::Matrix3d now = rows.body->state.orientation.toRotationMatrix();
        if ((now - rows.frame).squaredNorm() < 2 * kFrameTurn * kFrameTurn) continue;
        any = turned_[i] = true;
        turn_frame(rows, now);
    }
    auto has_turned = [this](const Side& side) {
        return side.body >= 0 && turned_[static_cast<std::size_t>(side.body)];
    };
    for (ContactRows& c : contacts_)
        if (any && (has_turned(c.side[0]) || has_turned(c.side[1]))) write_contact(c);
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

// The speed that an impact leaves: what the gap allows until the substep ends; rigid bodies rebound.
void IslandSolver::aim(ContactRows& c) const {
    const float h = static_cast<float>(h_);
    const float left = static_cast<float>((c.begins + 1) * h_) - c.point->begins;
    if (c.point->gap > 0) {
        c.bias = c.point->gap / std::max(left, 0.01f * h);
    } else {
        c.bias = is_rigid(c) && c.approach < -kBounceThreshold ? c.restitution * c.approach : 0;
    }
}

// Of bodies with modes, out of the energy that the impact took.
void IslandSolver::rebound(ContactRows& c) {
    if (is_rigid(c) || c.point->gap > 0) return;
    note_work(c, c.impulse[0]);
    restitute(c);
}

// The impact is over: applied at once, and no guess for the substeps to come.
void IslandSolver::end_impact(ContactRows& c) {
    c.over = goes_far(c);
    if (c.impulse[0] != 0) {
        const Eigen::Vector3d p =
            (c.impulse[0] * c.point->normal + c.impulse[1] * c.tangent[0] + c.impulse[2] * c.tangent[1])
                .cast<double>();
        if (c.told) tell(c, c.pair, p, p, c.impulse, place_now(c));
        apply(c, p, place_now(c));
    }
    const float time = c.point->begins - static_cast<float>(substep_ * h_);
    c.separation = c.point->gap - c.drifted - time * c.drift[0];  // with the way so far
    for (const Side& side : c.side)
        if (side.body >= 0)
            c.separation -= dot(jacobians_.data() + side.rows, moved_.data() + side.y, side.width);
    // One of bodies that ring is told from a new one.
    std::fill_n(c.impulse, 3, 0.f), std::fill_n(c.at_move, 3, 0.f);
    if (substep_ + 1 == settings_->substeps && !is_rigid(c)) c.impulse[0] = 1e-20f;
    c.approach = 0;
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
        way +=
            Eigen::Vector3d(y[3], y[4], y[5]).cwiseQuotient(kind.root_inertia).norm() * turn_reach_of(kind);
        size = std::min(size, smallest_half(kind));
    }
    if (!is_rigid(c)) way += static_cast<double>(std::hypot(v[1], v[2]));
    return way * (remaining_ + h_) > kStandsStill * size;
}

// A contact of bodies that move on in the step, in double precision and at one place of space a pair: what moved its
// bodies where they were before, what came after where it took them. So angular momentum is kept to rounding.
void IslandSolver::apply_moving(const ContactRows& c) {
    auto world = [&c](const float(&p)[3]) -> Eigen::Vector3d {
        return (p[0] * c.point->normal + p[1] * c.tangent[0] + p[2] * c.tangent[1]).cast<double>();
    };
    const Eigen::Vector3d at_move = world(c.at_move), after = world(c.impulse) - at_move;
    apply(c, at_move, place_now(c));
    if (after.isZero(0)) return;
    Eigen::Vector3d places[2];
    for (int i = 0; i < 2; ++i) {
        if (c.side[i].body < 0) continue;
        BodyRows& rows = rows_of_[static_cast<std::size_t>(c.side[i].body)];
        places[i] = std::exchange(rows.place, rows.body->state.position);
    }
    apply(c, after, place_now(c));
    for (int i = 0; i < 2; ++i)
        if (c.side[i].body >= 0) rows_of_[static_cast<std::size_t>(c.side[i].body)].place = places[i];
}

}  // namespace sim
