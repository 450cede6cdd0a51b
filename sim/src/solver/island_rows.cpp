#include "solver/island_rows.h"

#include <cmath>

// What an island's rows are made of, and what moves its bodies.

namespace sim {
namespace {

using ModeArray = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMostModes, 1>;  // on the stack

}  // namespace

std::size_t IslandRows::floats_of(int id) const {
    return id >= 0 && id < kFirstPlane && local(id) >= 0
               ? 3 * static_cast<std::size_t>(world[static_cast<std::size_t>(id)].kind->width)
               : 0;
}

void IslandRows::begin(const Island& of, const ContactScene& in) {
    island = &of, scene = &in;
    substep.h = substep.last_h = whole_substep();
    substep.level = 0;
    substep.begins = substep.now = 0;
    substep.inverse_h = static_cast<float>(1 / substep.h);
    local_.resize(world.size(), -1);
    bodies.resize(of.bodies.size());
    std::uint32_t offset = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        MovingBody& body = world[static_cast<std::size_t>(of.bodies[i])];
        local_[static_cast<std::size_t>(of.bodies[i])] = static_cast<int>(i);
        bodies[i].body = &body, bodies[i].offset = offset, bodies[i].width = body.kind->width;
        offset += static_cast<std::uint32_t>(body.kind->width);
    }
    places_.resize(bodies.size());
    each_body([this](BodyRows& rows) {
        places_[static_cast<std::size_t>(&rows - bodies.data())] = {rows.body->state.position,
                                                                    2 * rows.body->kind->half_box.maxCoeff()};
    });
    found_again = false;
    cross.drop_rebounds();
    y.resize(offset), start.resize(offset), moved.resize(offset), kept.resize(offset);
    std::fill_n(moved.data(), offset, 0.f);
    add_contacts();
    for (const int c : of.constraints) {
        HeldConstraint& held = constraints[static_cast<std::size_t>(c)];
        for (int i = 0; i < held.count; ++i) add_spring(held, held.points[static_cast<std::size_t>(i)]);
    }
}

void IslandRows::begin_body(BodyRows& rows) {
    MovingBody& body = *rows.body;
    rows.place = body.state.position, rows.time = 0, rows.frame = body.posed.rotation;
    rows.body_from_world = body.posed.rotation.transpose().cast<float>();
    rows.rotation = body.substep_rotation;
    rows.inverse_mass = 1 / body.kind->mass.mass;
    rows.in_impact = rows.stiff = false;
    BodyPath& path = paths[static_cast<std::size_t>(&body - world.data())];
    path.legs.clear();
    path.legs.reserve(4 * static_cast<std::size_t>(settings.substeps));
    path.end = settings.dt;
    path.inertia = body.kind->mass.inertia;
}

// What a block's contacts need.
IslandRows::Part IslandRows::part_of(std::span<const int> of) const {
    Part part;
    for (const int m : of) {
        const Manifold& manifold = manifolds[static_cast<std::size_t>(m)];
        std::size_t width = 0;
        for (const int id : {manifold.a, manifold.b})
            if (id < kFirstPlane && local(id) >= 0)
                width += static_cast<std::size_t>(bodies[static_cast<std::size_t>(local(id))].width);
        const auto count = static_cast<std::size_t>(manifold.count);
        part.contacts += count, part.floats += 3 * count * width;
        part.impacts = part.impacts || manifold.points[0].begins >= 0;
    }
    return part;
}

// The contacts' rows, in the order of blocks.
void IslandRows::add_contacts() {
    blocks.divide(crew(), places_, island->manifolds, manifolds, local_);
    each_body([this](BodyRows& rows) { begin_body(rows); });
    parts_.resize(blocks.size());
    crew().each(parts_.size(), 1, [&](int, std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b) parts_[b] = part_of(blocks.manifolds_of(b));
    });
    Part all;
    for (std::size_t b = 0; b < parts_.size(); ++b) {
        Part& part = parts_[b];
        part.contacts = std::exchange(all.contacts, all.contacts + part.contacts);
        part.floats = std::exchange(all.floats, all.floats + part.floats);
        all.impacts = all.impacts || part.impacts;
        blocks.set_contacts(b, part.contacts, all.contacts);
    }
    std::size_t floats = all.floats;
    for (const int c : island->constraints) {
        const HeldConstraint& held = constraints[static_cast<std::size_t>(c)];
        for (const int id : {held.definition.body_a, held.definition.body_b})
            floats += static_cast<std::size_t>(held.count) * floats_of(id);
    }
    jacobians.resize(floats);
    jacobians_used_ = all.floats;
    springs.clear(), impacts.clear();
    directly = any_bounce = any_struck = any_rebound = any_emerging = false;
    any_impacts = all.impacts;
    any_contacts = !island->manifolds.empty();
    cross.begin_island();
    contacts.resize(all.contacts);
    if (any_impacts) stiffen();
    windows_.resize(static_cast<std::size_t>(crew().size()));
    for (Window& window : windows_) window.next_turn.assign(bodies.size(), 0);
    crew().each(parts_.size(), 1, [this](int thread, std::size_t first, std::size_t last) {
        for (std::size_t b = first; b < last; ++b)
            fill_part(blocks.manifolds_of(b), windows_[static_cast<std::size_t>(thread)], parts_[b]);
    });
    std::size_t next = 0;
    for (const Part& part : parts_) {  // `contacts`: their end by now
        note(part);
        for (; next < part.contacts; ++next)
            if (part.impacts && contacts[next].firm) impacts.push_back(next);
    }
    if (cross.recorded())
        for (ContactRows& c : contacts) cross.note(c);
}

void IslandRows::note(const Part& part) noexcept {
    any_bounce = any_bounce || part.bounces;
    any_rebound = any_rebound || part.rebounds;
    any_emerging = any_emerging || part.emerging;
}

// A body that meets another so fast that its modes would yield beyond what they describe carries as if it were rigid in this step:
// its centre would run on through what it strikes. The speed: half of its thinnest half extent in the time of its slowest mode, 1 / omega.
void IslandRows::stiffen() {
    for (const int m : island->manifolds) {
        const Manifold& manifold = manifolds[static_cast<std::size_t>(m)];
        const ManifoldPoint& point = manifold.points[0];
        if (!(point.begins >= 0) || std::isinf(point.begins)) continue;
        auto velocity_of = [this](int id) -> Eigen::Vector3d {
            if (id >= kFirstPlane) return Eigen::Vector3d::Zero();
            return world[static_cast<std::size_t>(id)].state.velocity;
        };
        const double speed =
            std::abs(point.normal.cast<double>().dot(velocity_of(manifold.a) - velocity_of(manifold.b)));
        for (const int id : {manifold.a, manifold.b}) {
            if (id >= kFirstPlane || local(id) < 0) continue;
            BodyRows& rows = bodies[static_cast<std::size_t>(local(id))];
            const BodyKind& kind = *rows.body->kind;
            if (kind.modes > 0 &&
                speed > kGradientLimit * kind.half_box.minCoeff() * kind.basis.omega.minCoeff())
                rows.stiff = true;
        }
    }
}

// A block's contacts, by turns within windows.
void IslandRows::fill_part(std::span<const int> of, Window& window, Part& part) {
    auto turns_of = [&](int id) -> int* {
        if (id >= kFirstPlane || local(id) < 0) return nullptr;
        return &window.next_turn[static_cast<std::size_t>(local(id))];
    };
    for (const int m : of) {
        Manifold& manifold = manifolds[static_cast<std::size_t>(m)];
        int* const next[] = {turns_of(manifold.a), turns_of(manifold.b)};
        for (int i = 0; i < manifold.count; ++i) {
            if (window.contacts.size() == kWindow) flush(window, part);
            int turn = 0;
            for (const int* of_body : next)
                if (of_body) turn = std::max(turn, *of_body);
            for (int* of_body : next)
                if (of_body) *of_body = turn + 1;
            window.contacts.push_back({&manifold, i, turn});
        }
    }
    flush(window, part);
}

// Adds the window's contacts by turn, each turn's in order of ids, and begins anew.
void IslandRows::flush(Window& window, Part& part) {
    std::array<int, kWindow + 1> first{};
    std::array<const Turn*, kWindow> by_turn;
    for (const Turn& t : window.contacts) ++first[static_cast<std::size_t>(t.turn) + 1];
    for (std::size_t t = 1; t < first.size(); ++t) first[t] += first[t - 1];
    for (const Turn& t : window.contacts)
        by_turn[static_cast<std::size_t>(first[static_cast<std::size_t>(t.turn)]++)] = &t;
    for (std::size_t i = 0; i < window.contacts.size(); ++i) {
        Manifold& manifold = *by_turn[i]->manifold;
        fill_contact(contacts[part.contacts++], manifold,
                     manifold.points[static_cast<std::size_t>(by_turn[i]->point)], part);
    }
    for (const Turn& t : window.contacts)
        for (const int id : {t.manifold->a, t.manifold->b})
            if (id < kFirstPlane && local(id) >= 0) window.next_turn[static_cast<std::size_t>(local(id))] = 0;
    window.contacts.clear();
}

bool IslandRows::take_found() {
    found_again = true;
    if (found.empty() && contacts.empty()) return false;
    std::size_t floats = 0;
    for (const Manifold& m : found)
        floats += static_cast<std::size_t>(m.count) * (floats_of(m.a) + floats_of(m.b));
    for (const SpringRows& s : springs)
        floats += floats_of(s.constraint->definition.body_a) + floats_of(s.constraint->definition.body_b);
    jacobians.resize(floats);
    jacobians_used_ = 0;
    contacts.clear(), impacts.clear();
    any_impacts = false;
    any_bounce = any_rebound = any_emerging = false;
    cross.drop_rebounds();
    for (Manifold& m : found)
        for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) add_contact(m, m.points[i]);
    any_contacts = !contacts.empty();
    for (SpringRows& s : springs)
        for (RowSide& side : s.side) side = reserve_rows(side.body, jacobians_used_);
    return true;
}

int IslandRows::end() {
    each_contact([](const ContactRows& c) { keep_impulse(c, *c.point); });
    int broken = 0;
    for (const SpringRows& s : springs) {
        s.point->impulse = (s.moved + s.impulse).cast<float>();
        const double force = s.point->impulse.norm() / substep.h;
        if (!s.constraint->holds || !(force > s.constraint->definition.breaking_force)) continue;
        s.constraint->holds = false;
        ++broken;
    }
    for (const int id : island->bodies) local_[static_cast<std::size_t>(id)] = -1;
    return broken;
}

void IslandRows::write_leg(const BodyRows& rows, const Eigen::Vector3d& velocity,
                           const Eigen::Vector3d& momentum) {
    if (substep.h - rows.time < 1e-9 * substep.h) return;
    paths[static_cast<std::size_t>(rows.body - world.data())].legs.push_back(
        {.start = substep.begins + rows.time,
         .position = rows.place,
         .orientation = rows.body->state.orientation,
         .velocity = velocity,
         .momentum = momentum});
}

void IslandRows::load_velocities(BodyRows& rows) {
    const MovingBody& body = *rows.body;
    const BodyKind& kind = *body.kind;
    const WorldBodyState& s = body.state;
    rows.place = s.position, rows.time = 0;
    if (!any_contacts) {
        rows.frame = s.orientation.toRotationMatrix();
        rows.body_from_world = rows.frame.transpose().cast<float>();
    }
    const Eigen::Matrix3d& frame = rows.frame;
    const Eigen::Vector3d velocity = s.velocity + velocity_given(body, substep.h),
                          momentum = s.angular_momentum + momentum_given(body, substep.h);
    const Eigen::Matrix3d turned = s.orientation.toRotationMatrix();
    const Eigen::Vector3d spin =
        frame.transpose() * (turned * (turned.transpose() * momentum).cwiseQuotient(kind.mass.inertia));
    const double root_mass = kind.root_mass;
    float* out = start.data() + rows.offset;
    for (int i = 0; i < 3; ++i) {
        out[i] = static_cast<float>(root_mass * velocity[i]);
        out[3 + i] = static_cast<float>(kind.root_inertia[i] * spin[i]);
    }
    out[6] = out[7] = 0;
    const HeldSteps& step = of_substep(kind).held;
    Eigen::Map<Eigen::ArrayXf> mean(out + 8, kind.modes);
    mean =
        ((step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array()) / step.root_compliance).cast<float>();
    if (body.pushed) mean += (step.root_compliance * substep.h * body.modal_force.array()).cast<float>();
    for (int k = kind.modes; k < kind.mode_width; ++k) out[8 + k] = 0;
    std::copy_n(out, rows.width, y.data() + rows.offset);
}

// The modes under what the rows gave them, held over the substep.
bool IslandRows::step_modes(const BodyRows& rows) {
    MovingBody& body = *rows.body;
    const HeldSteps& step = of_substep(*body.kind).held;
    WorldBodyState& s = body.state;
    const Eigen::Map<const Eigen::ArrayXf> now(y.data() + rows.offset + 8, body.kind->modes),
        before(start.data() + rows.offset + 8, body.kind->modes);
    ModeArray held = (now.cast<double>() - before.cast<double>()) / step.root_compliance;
    if (body.pushed) held += substep.h * body.modal_force.array();
    const ModeArray mean =
        step.mean_z * s.q.array() + step.mean_rate * s.q_dot.array() + step.compliance * held;
    s.q_dot.array() = step.c * s.q.array() + step.d * s.q_dot.array() + step.rate * held;
    s.q.array() += substep.h * mean;
    return limit_deformation(body);
}

void IslandRows::turn_frame(BodyRows& rows, const Eigen::Matrix3d& frame) {
    const Eigen::Vector3d& root = rows.body->kind->root_inertia;
    float* turned = moved.data() + rows.offset + 3;
    const Eigen::Vector3d way =
        rows.frame * Eigen::Vector3d(turned[0], turned[1], turned[2]).cwiseQuotient(root);
    rows.frame = frame;
    rows.body_from_world = frame.transpose().cast<float>();
    const Eigen::Vector3d again = (frame.transpose() * way).cwiseProduct(root);
    for (int k = 0; k < 3; ++k) turned[k] = static_cast<float>(again[k]);
}

// The least half extent of the bodies that rows join [m].
double IslandRows::size_of(const Rows& rows) const {
    double least = std::numeric_limits<double>::infinity();
    for (const RowSide& side : rows.side)
        if (side.body >= 0)
            least =
                std::min(least, bodies[static_cast<std::size_t>(side.body)].body->kind->half_box.minCoeff());
    return least;
}

}  // namespace sim
