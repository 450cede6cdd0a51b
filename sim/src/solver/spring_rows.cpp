#include "solver/island_rows.h"

namespace sim {

void IslandRows::add_spring(HeldConstraint& constraint, HeldPoint& point) {
    const PointConstraint& held = constraint.definition;
    SpringRows s{};
    s.point = &point, s.axes.setIdentity();
    s.impulse = point.impulse.cast<double>() / 2;  // each half, at rest
    s.place.setZero(), s.moved.setZero(), s.offset.setZero(), s.gap.setZero();
    auto local_of = [this](int body) { return body >= 0 ? local(body) : -1; };
    s.side[0] = reserve_rows(local_of(held.body_a), jacobians_used_);
    s.side[1] = reserve_rows(local_of(held.body_b), jacobians_used_);
    s.constraint = &constraint;
    s.recorded = cross.note(s);
    springs.push_back(s);
}

IslandRows::End IslandRows::end_of(int body, const Eigen::Vector3d& rest, float* shapes) const {
    if (body < 0) return {rest, {-1, Eigen::Vector3f::Zero(), nullptr}};
    const MovingBody& b = world[static_cast<std::size_t>(body)];
    const BodyKind& kind = *b.kind;
    if (b.driven) {
        const BodyPath::Pose pose = pose_of(body, substep.now);
        const Eigen::Vector3d arm = pose.orientation * rest;
        return {pose.position + arm, {-1, arm.cast<float>(), nullptr}};
    }
    Eigen::Vector3d point = rest;
    if (kind.modes > 0) {
        kind.shapes_at(rest.cast<float>(), shapes);
        for (int k = 0; k < kind.modes; ++k) {
            double q = b.state.q[k];
            if (modes_ahead && local(body) >= 0)  // under what acts so far, held over the substep
                q += substep.h * of_substep(kind).held.root_compliance[k] *
                     static_cast<double>(y.data()[bodies[static_cast<std::size_t>(local(body))].offset + 8 +
                                                  static_cast<std::uint32_t>(k)]);
            for (int axis = 0; axis < 3; ++axis)
                point[axis] += static_cast<double>(shapes[axis * kind.mode_width + k]) * q;
        }
    }
    const Eigen::Vector3d arm = b.state.orientation * point;
    const Eigen::Vector3d& centre =
        local(body) < 0 ? b.state.position : bodies[static_cast<std::size_t>(local(body))].place;
    return {centre + arm, {local(body), arm.cast<float>(), kind.modes > 0 ? shapes : nullptr}};
}

Eigen::Quaterniond IslandRows::orientation_of(int body) const {
    if (body < 0) return Eigen::Quaterniond::Identity();
    const MovingBody& b = world[static_cast<std::size_t>(body)];
    return b.driven ? pose_of(body, substep.now).orientation : b.state.orientation;
}

// Springs act over large turns, so their arms and rows follow the bodies every substep.
void IslandRows::write_spring(SpringRows& s) {
    const PointConstraint& held = s.constraint->definition;
    alignas(32) float scratch[2][3 * kMostModes];
    const End a = end_of(held.body_a, s.point->a, scratch[0]);
    End b = end_of(held.body_b, s.point->b, scratch[1]);
    const Eigen::Quaterniond turned = orientation_of(held.body_b);
    if (s.point->turns) {
        s.axes = s.point->directions * turned.conjugate().toRotationMatrix();
        b.place.arm += (a.point - b.point).cast<float>();  // of b's matter at a's point
    }
    const Eigen::Matrix3f axes = s.axes.cast<float>();
    write_rows(a.place, axes, 1, s.side[0]);
    write_rows(b.place, axes, -1, s.side[1]);
    finish_rows(s);
    s.drift = axes * (speed_of(held.body_a, a.place.arm.cast<double>()) -
                      speed_of(held.body_b, b.place.arm.cast<double>()))
                         .cast<float>();
    s.place = s.point->turns ? a.point : Eigen::Vector3d((a.point + b.point) / 2);
    s.gap = s.point->gap(a.point, b.point, turned);
}

bool IslandRows::is_carried(const Island& of) const {
    auto driven = [this](int id) {
        return id >= 0 && id < kFirstPlane && world[static_cast<std::size_t>(id)].driven;
    };
    return std::ranges::any_of(of.manifolds,
                               [&](int m) {
                                   const Manifold& manifold = manifolds[static_cast<std::size_t>(m)];
                                   return driven(manifold.a) || driven(manifold.b);
                               }) ||
           std::ranges::any_of(of.constraints, [&](int c) {
               const PointConstraint& held = constraints[static_cast<std::size_t>(c)].definition;
               return driven(held.body_a) || driven(held.body_b);
           });
}

// Where a body that the island does not move is, and how.
BodyPath::Pose IslandRows::pose_of(int body, double time) const {
    const MovingBody& b = world[static_cast<std::size_t>(body)];
    if (b.driven) return paths[static_cast<std::size_t>(body)].at(time);
    return {b.state.position, b.state.orientation};
}

// Speed of its matter at a place, mean over the substep.
Eigen::Vector3d IslandRows::speed_of(int body, const Eigen::Vector3d& arm) const {
    if (body < 0 || body >= kFirstPlane || !world[static_cast<std::size_t>(body)].driven)
        return Eigen::Vector3d::Zero();
    const BodyPath::Pose from = pose_of(body, substep.begins), to = pose_of(body, substep.begins + substep.h);
    const Eigen::AngleAxisd turn(to.orientation * from.orientation.conjugate());
    return (to.position - from.position + turn.angle() * turn.axis().cross(arm)) / substep.h;
}

}  // namespace sim
