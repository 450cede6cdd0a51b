#include <algorithm>
#include <cmath>
#include <limits>

#include "world/island_solver.h"

// Contacts found again within a step, where bodies have moved on; see IslandSolver.

namespace sim {

void IslandSolver::note_places() {
    for (BodyRows& rows : rows_of_) {
        rows.found_at = rows.body->state.position;
        rows.found_turned = rows.body->state.orientation;
    }
}

// Whether bodies have left where contacts were found by so much that these are others.
bool IslandSolver::moved_on() const {
    return std::ranges::any_of(rows_of_, [](const BodyRows& rows) {
        const WorldBodyState& s = rows.body->state;
        const double turn = 2 * (rows.found_turned.conjugate() * s.orientation).vec().norm();
        const double moved = (s.position - rows.found_at).norm() + turn * turn_reach_of(*rows.body->kind);
        return moved > kSlow * rows.body->kind->half_box.minCoeff();
    });
}

bool IslandSolver::may_follow(const Island& island) const {
    if (island.bodies.size() > kMostFollowed) return false;
    const double dt = settings_->dt, shortest = dt / settings_->substeps / (1 << kMostFollowLevel);
    bool thin = false;
    for (const int id : island.bodies) {
        const MovingBody& body = (*bodies_)[static_cast<std::size_t>(id)];
        if (told_crossed_ && !body.own) return false;  // swept, as all of it would be
        const double least = kSlow * body.kind->half_box.minCoeff();
        if ((body.state.velocity.norm() + turning_speed(body)) * shortest > least) return false;
        thin = thin || dt * dt * settings_->gravity.norm() > least;
    }
    return thin;
}

bool IslandSolver::moves_little() const {
    return std::ranges::all_of(rows_of_, [this](const BodyRows& rows) {
        const MovingBody& body = *rows.body;
        return (body.state.velocity.norm() + turning_speed(body)) * h_ <
               kSlow * body.kind->half_box.minCoeff();
    });
}

// The contacts where the bodies are when the step begins; what was foreseen does not count.
void IslandSolver::start_following() {
    found_.clear();
    for (const int m : island_->manifolds) {
        found_.push_back((*manifolds_)[static_cast<std::size_t>(m)]);
        for (ManifoldPoint& point : found_.back().points) point.begins = -1, point.gap = 0;
    }
    contact_finder_.find(*scene_, island_->bodies, *paths_, time_, found_);
    take_found(most_with_springs());
    if (!direct_) (void)begin_direct(most_with_springs(), true);
}

// The contacts anew, where the bodies are.
void IslandSolver::find_again() {
    const std::vector<int>& of_island = island_->manifolds;
    if (!found_again_) {
        found_.clear();
        for (const int m : of_island) found_.push_back((*manifolds_)[static_cast<std::size_t>(m)]);
    }
    for (const ContactRows& c : contacts_) {
        std::ptrdiff_t place = c.manifold - (found_again_ ? found_ : *manifolds_).data();
        if (!found_again_)
            place = std::ranges::lower_bound(of_island, static_cast<int>(place)) - of_island.begin();
        ManifoldPoint& point = found_[static_cast<std::size_t>(place)]
                                   .points[static_cast<std::size_t>(c.point - c.manifold->points.data())];
        keep_impulse(c, point);
        point.separation = c.now, point.begins = static_cast<float>(c.starts);
    }
    std::erase_if(found_, [](const Manifold& m) { return std::isinf(m.points[0].begins); });
    contact_finder_.find(*scene_, island_->bodies, *paths_, time_, found_);
    take_found(springs_.empty() ? std::numeric_limits<double>::infinity() : most_with_springs());
}

// Rows of the contacts that were found.
void IslandSolver::take_found(double most) {
    found_again_ = true;
    note_places();
    fresh_ = true;
    if (found_.empty() && contacts_.empty()) return;
    std::size_t floats = 0;
    auto width_of = [this](int id) {
        return id >= 0 && id < kFirstPlane && local(id) >= 0
                   ? 3 * static_cast<std::size_t>((*bodies_)[static_cast<std::size_t>(id)].kind->width)
                   : 0;
    };
    for (const Manifold& m : found_)
        floats += static_cast<std::size_t>(m.count) * (width_of(m.a) + width_of(m.b));
    for (const SpringRows& s : springs_)
        floats += width_of(s.constraint->definition.body_a) + width_of(s.constraint->definition.body_b);
    jacobians_.resize(floats);
    jacobians_used_ = 0;
    contacts_.clear(), impacts_.clear(), first_contact_.clear();
    any_impacts_ = false;
    any_bounce_ = any_rebound_ = any_emerging_ = false;
    part_rebounds(true);
    for (Manifold& m : found_)
        for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) add_contact(m, m.points[i]);
    any_contacts_ = !contacts_.empty();
    for (SpringRows& s : springs_)
        for (Side& side : s.side) side = reserve_rows(side.body, jacobians_used_);
    (void)begin_direct(most, true);
}

}  // namespace sim
