#include "solver/cross_impulses.h"

#include <algorithm>

#include "solver/island_rows.h"

namespace sim {

void CrossImpulses::drop_rebounds() {
    const auto is_ghost = [](const BodyRows& body) { return !body.body->own; };
    if (!recorded_ || std::ranges::none_of(rows_.bodies, is_ghost)) return;
    const auto moves = [this](int id) { return id < kFirstPlane && rows_.local(id) >= 0; };
    const auto neighbours = [this](int id) -> int& {
        return neighbours_[static_cast<std::size_t>(rows_.local(id))];
    };
    neighbours_.assign(rows_.bodies.size(), 0);
    std::uint64_t last = ~std::uint64_t{0};
    rows_.each_manifold([&](const Manifold& m) {
        if (std::exchange(last, m.key()) == m.key() || !moves(m.a) || !moves(m.b)) return;
        ++neighbours(m.a), ++neighbours(m.b);
    });
    const auto ghost = [&](int id) {
        return is_ghost(rows_.bodies[static_cast<std::size_t>(rows_.local(id))]);
    };
    rows_.each_manifold([&](Manifold& m) {
        if (!moves(m.a) || !moves(m.b) || (neighbours(m.a) == 1 && neighbours(m.b) == 1)) return;
        if (ghost(m.a) != ghost(m.b)) m.restitution = 0;
    });
}

// Place among the pairs of an own body's contact with a ghost, else -1.
int CrossImpulses::pair_of(const Manifold& manifold) {
    if (manifold.b >= kFirstPlane || rows_.local(manifold.a) < 0 || rows_.local(manifold.b) < 0) return -1;
    const MovingBody &a = rows_.world[static_cast<std::size_t>(manifold.a)],
                     &b = rows_.world[static_cast<std::size_t>(manifold.b)];
    if (a.own == b.own) return -1;
    any_ = true;
    const int own = a.own ? manifold.a : manifold.b, ghost = a.own ? manifold.b : manifold.a;
    for (std::size_t i = first_; i < pairs_.size(); ++i)
        if (pairs_[i].own == own && pairs_[i].ghost == ghost) return static_cast<int>(i);
    pairs_.emplace_back(own, ghost);
    return static_cast<int>(pairs_.size()) - 1;
}

void CrossImpulses::note(ContactRows& c) {
    c.pair = pair_of(*c.manifold);
    c.recorded = note_watched(c, true) || c.pair >= 0;
}

// Impulses of planes and fixed bodies are not recorded: a worker with a ghost of the body computes them.
bool CrossImpulses::note_watched(const Rows& rows, bool contact) {
    bool watched = false, both = true;
    for (const RowSide& side : rows.side) {
        both = both && side.body >= 0;
        watched =
            watched || (side.body >= 0 && rows_.bodies[static_cast<std::size_t>(side.body)].body->watched);
    }
    const bool noted = watched && (both || !contact);
    any_ = any_ || noted;
    return noted;
}

void CrossImpulses::forget(int body) {
    std::erase_if(pairs_, [body](const CrossImpulse& c) { return c.own == body || c.ghost == body; });
}

void CrossImpulses::add(const CrossImpulse& more) {
    const auto found = std::ranges::find_if(
        pairs_, [&](const CrossImpulse& c) { return c.own == more.own && c.ghost == more.ghost; });
    if (found == pairs_.end()) return pairs_.push_back(more);
    found->rebound = found->rebound || more.rebound;
    found->linear += more.linear;
    found->angular_own += more.angular_own, found->angular_ghost += more.angular_ghost;
}

void CrossImpulses::record(const Rows& rows, int pair, const Eigen::Vector3d& impulse,
                           const float (&along)[3], const Eigen::Vector3d& point) {
    for (int which = 0; which < 2; ++which) {
        const RowSide& side = rows.side[which];
        if (side.body < 0) continue;
        const BodyRows& at = rows_.bodies[static_cast<std::size_t>(side.body)];
        MovingBody& body = *at.body;
        const Eigen::Vector3d p = which == 0 ? impulse : Eigen::Vector3d(-impulse);
        const Eigen::Vector3d turn = (point - at.place).cross(p);
        if (pair >= 0) {
            CrossImpulse& cross = pairs_[static_cast<std::size_t>(pair)];
            if (body.own) cross.linear += p;
            (body.own ? cross.angular_own : cross.angular_ghost) += turn;
            continue;
        }
        if (!body.watched) continue;
        if (!std::exchange(body.was_given, true)) body.given.set_zero();
        body.given.linear += p;
        body.given.angular += turn;
        const float* d = rows_.jacobians.data() + side.rows + 8;
        const HeldSteps& step = rows_.of_substep(*body.kind).held;
        for (int k = 0; k < body.kind->modes; ++k)
            body.given.modal[k] += static_cast<double>(along[0] * d[k] + along[1] * d[side.width + k] +
                                                       along[2] * d[2 * side.width + k]) /
                                   step.root_compliance[k];
    }
}

}  // namespace sim
