#include "solver/found_contacts.h"

#include <algorithm>

namespace sim {
namespace {

// [bodies] Of an island that is followed: all are solved in each halving, so larger ones take long.
constexpr std::size_t kMostFollowed = 64;

}  // namespace

void FoundContacts::note_places() {
    for (BodyRows& rows : rows_.bodies) {
        rows.found_at = rows.body->state.position;
        rows.found_turned = rows.body->state.orientation;
    }
}

bool FoundContacts::moved_on() const {
    return std::ranges::any_of(rows_.bodies, [](const BodyRows& rows) {
        const WorldBodyState& s = rows.body->state;
        const double turn = 2 * (rows.found_turned.conjugate() * s.orientation).vec().norm();
        const double moved = (s.position - rows.found_at).norm() + turn * turn_reach_of(*rows.body->kind);
        return moved > kSlow * rows.body->kind->half_box.minCoeff();
    });
}

bool FoundContacts::moves_little() const {
    return std::ranges::all_of(rows_.bodies, [this](const BodyRows& rows) {
        const MovingBody& body = *rows.body;
        return (body.state.velocity.norm() + turning_speed(body)) * rows_.substep.h <
               kSlow * body.kind->half_box.minCoeff();
    });
}

bool FoundContacts::find_at_start() {
    rows_.found.clear();
    for (const int m : rows_.island->manifolds) {
        rows_.found.push_back(rows_.manifolds[static_cast<std::size_t>(m)]);
        for (ManifoldPoint& point : rows_.found.back().points) point.begins = -1, point.gap = 0;
    }
    return take();
}

bool FoundContacts::find_again() {
    const std::vector<int>& of_island = rows_.island->manifolds;
    if (!rows_.found_again) {
        rows_.found.clear();
        for (const int m : of_island) rows_.found.push_back(rows_.manifolds[static_cast<std::size_t>(m)]);
    }
    for (const ContactRows& c : rows_.contacts) {
        std::ptrdiff_t place = c.manifold - (rows_.found_again ? rows_.found : rows_.manifolds).data();
        if (!rows_.found_again)
            place = std::ranges::lower_bound(of_island, static_cast<int>(place)) - of_island.begin();
        ManifoldPoint& point = rows_.found[static_cast<std::size_t>(place)]
                                   .points[static_cast<std::size_t>(c.point - c.manifold->points.data())];
        IslandRows::keep_impulse(c, point);
        point.separation = c.now, point.begins = static_cast<float>(c.starts);
    }
    std::erase_if(rows_.found, [](const Manifold& m) { return std::isinf(m.points[0].begins); });
    return take();
}

bool FoundContacts::take() {
    finder_.find(*rows_.scene, rows_.island->bodies, rows_.paths, rows_.substep.begins, rows_.found);
    note_places();
    return rows_.take_found();
}

bool FoundContacts::may_follow(const Island& island) const {
    if (island.bodies.size() > kMostFollowed) return false;
    const double dt = rows_.settings.dt, shortest = rows_.whole_substep() / (1 << kMostFollowLevel);
    bool thin = false;
    for (const int id : island.bodies) {
        const MovingBody& body = rows_.world[static_cast<std::size_t>(id)];
        if (rows_.cross.recorded() && !body.own) return false;  // swept, as all of it would be
        const double least = kSlow * body.kind->half_box.minCoeff();
        if ((body.state.velocity.norm() + turning_speed(body)) * shortest > least) return false;
        thin = thin || dt * dt * rows_.settings.gravity.norm() > least;
    }
    return thin;
}

}  // namespace sim
