#include <algorithm>
#include <cmath>

#include "solver/island_rows.h"
#include "solver/row_kernels.h"

namespace sim {
namespace {

/// Two unit vectors square to n and to each other.
void set_tangents(const Eigen::Vector3f& n, Eigen::Vector3f (&t)[2]) {
    const Eigen::Vector3f axis =
        std::abs(n.x()) < 0.6f ? Eigen::Vector3f::UnitX() : Eigen::Vector3f(Eigen::Vector3f::UnitZ());
    t[0] = (axis - axis.dot(n) * n).normalized();
    t[1] = n.cross(t[0]);
}

}  // namespace

IslandRows::Place IslandRows::place_on(int body, const Eigen::Vector3f& arm, int sample,
                                       const Eigen::Vector3f& rest, float* scratch) const {
    const bool moves = body >= 0 && body < kFirstPlane && local(body) >= 0;
    if (!moves) return {-1, arm, nullptr};
    const BodyKind& kind = *world[static_cast<std::size_t>(body)].kind;
    if (kind.modes == 0) return {local(body), arm, nullptr};
    if (sample >= 0)
        return {local(body), arm,
                kind.sample_shapes.data() + static_cast<std::size_t>(sample) * 3 * kind.mode_width};
    kind.shapes_at(rest, scratch);
    return {local(body), arm, scratch};
}

RowSide IslandRows::reserve_rows(int body, std::size_t& used) const {
    if (body < 0) return {};
    const BodyRows& rows = bodies[static_cast<std::size_t>(body)];
    const RowSide side{body, rows.width, static_cast<std::uint32_t>(used), rows.offset};
    used += 3 * static_cast<std::size_t>(rows.width);
    return side;
}

void IslandRows::write_rows(const Place& place, const Eigen::Matrix3f& directions, float sign,
                            const RowSide& side) {
    if (place.body < 0) return;
    const BodyRows& rows = bodies[static_cast<std::size_t>(place.body)];
    const BodyKind& kind = *rows.body->kind;
    const Eigen::Matrix3f& body_from_world = rows.body_from_world;
    const Eigen::Vector3f root_inertia = kind.root_inertia.cast<float>().cwiseInverse();
    const float root_mass = static_cast<float>(1 / kind.root_mass);
    for (int r = 0; r < 3; ++r) {
        float* out = jacobians.data() + side.rows + r * side.width;
        const Eigen::Vector3f direction = sign * directions.row(r).transpose();
        const Eigen::Vector3f turn =
            (body_from_world * place.arm.cross(direction)).cwiseProduct(root_inertia);
        for (int i = 0; i < 3; ++i) out[i] = root_mass * direction[i], out[3 + i] = turn[i];
        out[6] = out[7] = 0;
        if (!place.shapes) continue;
        if (rows.stiff || rows.body->at_limit) {  // what cannot yield any more carries as if it were rigid
            std::fill_n(out + 8, kind.mode_width, 0.f);
            continue;
        }
        const Eigen::Vector3f own = body_from_world * direction;
        const int width = kind.mode_width;
        const float* root_compliance = of_substep(kind).root_compliance.data();
        for (int k = 0; k < width; k += kLanes)
            store_lanes(out + 8 + k, load_lanes(root_compliance + k) *
                                         (own.x() * load_lanes(place.shapes + k) +
                                          own.y() * load_lanes(place.shapes + width + k) +
                                          own.z() * load_lanes(place.shapes + 2 * width + k)));
    }
}

void IslandRows::finish_rows(Rows& rows) {
    for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) {
            float sum = 0;
            for (const RowSide& side : rows.side) {
                if (side.body < 0) continue;
                const float* d = jacobians.data() + side.rows;
                sum += dot(d + i * side.width, d + j * side.width, side.width);
            }
            rows.k[i][j] = rows.k[j][i] = sum;
        }
}

// In which an impact is due.
int IslandRows::substep_of(const ManifoldPoint& point) const {
    return static_cast<int>(std::min(static_cast<double>(point.begins) * settings.substeps / settings.dt,
                                     settings.substeps - 1.));
}

void IslandRows::add_contact(Manifold& manifold, ManifoldPoint& point) {
    Part part;
    part.floats = jacobians_used_;
    fill_contact(contacts.extend(), manifold, point, part);
    jacobians_used_ = part.floats;
    if (cross.recorded()) cross.note(contacts.back());
    note(part);
    if (contacts.back().firm) impacts.push_back(contacts.size() - 1), any_impacts = true;
}

// part: where its rows begin among jacobians, and what it is then noted in.
void IslandRows::fill_contact(ContactRows& c, Manifold& manifold, ManifoldPoint& point, Part& part) {
    auto moving = [this](int id) { return id < kFirstPlane ? local(id) : -1; };
    c = {};
    c.manifold = &manifold;
    c.point = &point;
    c.side[0] = reserve_rows(moving(manifold.a), part.floats);
    c.side[1] = reserve_rows(moving(manifold.b), part.floats);
    c.starts = static_cast<double>(point.begins);
    // Only what comes together rebounds, not what rests and rings.
    c.restitution = point.normal_impulse > 0 ? 0 : manifold.restitution;
    c.firm = c.starts >= 0;
    set_tangents(point.normal, c.tangent);
    write_contact(c);
    c.separation = c.now = point.separation;
    c.friction = manifold.friction;
    c.emerging = manifold.emerging;
    part.bounces = part.bounces || (c.restitution > 0 && is_rigid(c));
    part.rebounds = part.rebounds || c.restitution > 0;
    part.emerging = part.emerging || c.emerging;
    c.impulse[0] = point.normal_impulse;
    c.impulse[1] = point.friction_impulse.dot(c.tangent[0]);
    c.impulse[2] = point.friction_impulse.dot(c.tangent[1]);
    if (!c.firm) return;
    c.begins = substep_of(point);
    c.over = std::isinf(c.starts);
}

// The rows of a contact, in the bodies' frames as they are now, at the one point at which its impulses act, once it has
// begun.
void IslandRows::write_contact(ContactRows& c) {
    alignas(32) float scratch[2][3 * kMostModes];
    const ManifoldPoint& point = *c.point;
    Eigen::Vector3f arms[2] = {point.arm_a, point.arm_b};
    if (c.side[0].body >= 0 && c.side[1].body >= 0 && c.starts < substep.begins + substep.h) {
        const Eigen::Vector3d at = place_now(c);
        for (int side = 0; side < 2; ++side)
            arms[side] = (at - bodies[static_cast<std::size_t>(c.side[side].body)].place).cast<float>();
    }
    const Place a = place_on(c.manifold->a, arms[0], point.sample_a, point.rest_a, scratch[0]);
    const Place b = place_on(c.manifold->b, arms[1], point.sample_b, point.rest_b, scratch[1]);
    Eigen::Matrix3f directions;
    directions << point.normal.transpose(), c.tangent[0].transpose(), c.tangent[1].transpose();
    write_rows(a, directions, 1, c.side[0]);
    write_rows(b, directions, -1, c.side[1]);
    finish_rows(c);
    see_driven(c);
    c.inverse_normal = 1 / c.k[0][0];
    c.slide_mass = 2 / (c.k[1][1] + c.k[2][2]);
    const float det = c.k[1][1] * c.k[2][2] - c.k[1][2] * c.k[1][2];
    c.inverse_tangent[0] = c.k[2][2] / det, c.inverse_tangent[1] = -c.k[1][2] / det,
    c.inverse_tangent[2] = c.k[1][1] / det;
}

// What the rows of a contact see of bodies that move as prescribed.
void IslandRows::see_driven(ContactRows& c) const {
    const int a = c.manifold->a, b = c.manifold->b;
    const bool any = world[static_cast<std::size_t>(a)].driven ||
                     (b < kFirstPlane && world[static_cast<std::size_t>(b)].driven);
    if (!any) return;
    const Eigen::Vector3d place = place_now(c);
    const int driven = c.side[0].body < 0 ? a : b;
    const Eigen::Vector3d v = speed_of(driven, place - pose_of(driven, substep.now).position);
    const Eigen::Vector3f seen = (driven == a ? v : Eigen::Vector3d(-v)).cast<float>();
    c.drift = {c.point->normal.dot(seen), c.tangent[0].dot(seen), c.tangent[1].dot(seen)};
}

// Half-way between where the contact would be if it moved with either centre.
Eigen::Vector3d IslandRows::place_now(const ContactRows& c) const {
    const RowSide &a = c.side[0], &b = c.side[1];
    auto with = [this](const RowSide& side, const Eigen::Vector3f& arm) -> Eigen::Vector3d {
        return bodies[static_cast<std::size_t>(side.body)].place + arm.cast<double>();
    };
    if (b.body < 0) return with(a, c.point->arm_a);
    if (a.body < 0) return with(b, c.point->arm_b);
    return (with(a, c.point->arm_a) + with(b, c.point->arm_b)) / 2;
}

// In double precision and at one point of space a pair, so that linear and angular momentum are kept to
// rounding.
void IslandRows::apply(const Rows& rows, const Eigen::Vector3d& impulse, const Eigen::Vector3d& point,
                       Eigen::Vector3d& from_outside) {
    const RowSide &a = rows.side[0], &b = rows.side[1];
    if (b.body < 0 && bodies[static_cast<std::size_t>(a.body)].body->own) from_outside += impulse;
    if (a.body < 0 && bodies[static_cast<std::size_t>(b.body)].body->own) from_outside -= impulse;
    for (const RowSide& side : rows.side) {
        if (side.body < 0) continue;
        const BodyRows& at = bodies[static_cast<std::size_t>(side.body)];
        WorldBodyState& s = at.body->state;
        const Eigen::Vector3d p = &side == &rows.side[0] ? impulse : Eigen::Vector3d(-impulse);
        s.velocity += at.inverse_mass * p;
        s.angular_momentum += (point - at.place).cross(p);
    }
}

// A contact's impulse (of it what moves its bodies), at the place where it is now.
[[gnu::flatten]] void IslandRows::apply(const ContactRows& c, const float (&impulse)[3],
                                        Eigen::Vector3d& from_outside) {
    if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) return;
    const Eigen::Vector3d p =
        (impulse[0] * c.point->normal + impulse[1] * c.tangent[0] + impulse[2] * c.tangent[1]).cast<double>();
    const Eigen::Vector3d place = place_now(c);
    if (c.recorded) cross.record(c, c.pair, p, impulse, place);
    apply(c, p, place, from_outside);
}

void IslandRows::keep_impulse(const ContactRows& c, ManifoldPoint& point) {
    point.normal_impulse = c.impulse[0];
    point.friction_impulse = c.impulse[1] * c.tangent[0] + c.impulse[2] * c.tangent[1];
}

}  // namespace sim
