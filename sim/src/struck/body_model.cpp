#include "struck/body_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kScaleLimit = 0.4, kShearLimit = 0.15, kSwingLimit = 1;
constexpr double kNearEdge = 0.95;  // share of the semi-axis
constexpr double kReferenceSpeed_mps = 5;
constexpr double kNegligible =
    1e-30;  // far below any digit of a shape; spares the processor denormal numbers

struct Limited {
    double value, slope;
};

Limited limited(double s, double limit) {
    const double half = 0.5 * limit, excess = std::abs(s) / half - 1;
    if (excess <= 0) return {s, 1};
    const double t = std::tanh(excess);
    return {std::copysign(half + half * t, s), 1 - t * t};
}

double strain_limit(int i) {
    return i < 3 ? kScaleLimit : kShearLimit;
}

Eigen::Matrix3d strain_matrix(const Vector6d& q) {
    Eigen::Matrix3d e;
    e << q[0], q[5], q[4], q[5], q[1], q[3], q[4], q[3], q[2];
    return e;
}

// Shortest semi-axis; of equal ones y, then x.
int shortest_axis(const Eigen::Vector3d& s) {
    if (s.y() <= s.x() && s.y() <= s.z()) return 1;
    return s.x() <= s.z() ? 0 : 2;
}

}  // namespace

BodyModel::BodyModel(const BodyDefinition& definition)
    : definition_((check_body(definition), definition)),
      gauge_(definition.shape),
      linear_(make_linear_body(gauge_, definition.material)),
      body_from_world_(definition.world_from_body.inverse()),
      omega_(OscillatorVector::Ones()),
      sigma_(OscillatorVector::Ones()) {
    set_hinge();
    if (definition_.visual.enabled) set_visual_modes();
}

void BodyModel::set_hinge() {
    double mass = definition_.stick_mass_kg;
    if (definition_.stand.hinged) {
        Stand& stand = definition_.stand;
        stand.axis_body.normalize();
        mass = mass * linear_.mass / (mass + linear_.mass);
        const Eigen::Vector3d& axis = stand.axis_body;
        const Eigen::Vector3d about = Eigen::Vector3d::Constant(linear_.moments.sum()) - linear_.moments;
        hinge_inertia_ =
            axis.cwiseAbs2().dot(about) + linear_.mass * axis.cross(stand.pivot_body).squaredNorm();
        omega_[6] = 2 * M_PI * stand.frequency_hz;
        sigma_[6] = stand.damping_ratio * omega_[6];
    }
    impulse_per_speed_ = (1 + definition_.restitution) * mass;
}

void BodyModel::set_visual_modes() {
    const VisualModes& visual = definition_.visual;
    omega_.head<6>() = linear_.omega * (2 * M_PI * visual.frequency_hz / linear_.omega.minCoeff());
    sigma_.head<6>().setConstant(std::log(1000.0) / visual.decay_s);
    const Eigen::Vector3d& s = gauge_.semi_axes();
    const int axis = shortest_axis(s);
    double peak = 0;
    for (int k = 0; k < 3;
         ++k) {  // the pole, and near the edge along either other axis, where a disc gives way most
        Eigen::Vector3d r = Eigen::Vector3d::Zero();
        if (k != axis) r[k] = kNearEdge * s[k];
        peak = std::max(peak, reference_peak(gauge_.along_axis(r, axis), axis));
    }
    gain_ = visual.displacement * 2 * s.maxCoeff() / peak;
}

// Largest displacement, along `axis`, of the point r after the reference strike there, with gain 1 [m]:
//   u(t) = J sum_i (phi_i . Q)^2 h_i(t),  Q = du/dq,  h_i the impulse response of mode i
double BodyModel::reference_peak(const Eigen::Vector3d& r, int axis) const {
    constexpr int kSamples = 4096;
    const double span = std::max(2 * M_PI / omega_.head<6>().minCoeff(), definition_.visual.decay_s);
    const Vector6d response =
        linear_.strain_from_modal.transpose() * strain_impulse(Eigen::Vector3d::Unit(axis), r);
    const Vector6d weights = response.cwiseAbs2() * (impulse_per_speed_ * kReferenceSpeed_mps);
    const auto displacement = [&](double t) {
        double sum = 0;
        for (int i = 0; i < 6; ++i)
            sum += weights[i] == 0 ? 0 : weights[i] * oscillator_step(omega_[i], sigma_[i], t).b;
        return std::abs(sum);
    };
    double best = 0, at = 0;
    for (int k = 1; k <= kSamples; ++k) {
        const double t = span * k / kSamples, u = displacement(t);
        if (u > best) best = u, at = t;
    }
    double low = at - span / kSamples, high = at + span / kSamples;
    for (int k = 0; k < 60; ++k) {  // ternary search within the sampled peak
        const double left = low + (high - low) / 3, right = high - (high - low) / 3;
        (displacement(left) < displacement(right) ? low : high) =
            displacement(left) < displacement(right) ? left : right;
    }
    return displacement(0.5 * (low + high));
}

OscillatorState BodyModel::to_oscillators(const ModalState& state) const noexcept {
    OscillatorState s;
    s.z << linear_.modal_from_strain * state.q, state.swing;
    s.z_dot << linear_.modal_from_strain * state.q_dot, state.swing_dot;
    return s;
}

ModalState BodyModel::to_modal(const OscillatorState& s) const noexcept {
    return {linear_.strain_from_modal * s.z.head<6>(), linear_.strain_from_modal * s.z_dot.head<6>(), s.z[6],
            s.z_dot[6]};
}

OscillatorState BodyModel::after(const OscillatorState& state, double dt) const noexcept {
    OscillatorState next = state;
    if (!(dt > 0)) return next;
    for (int i = 0; i < 7; ++i) {
        if (next.z[i] == 0 && next.z_dot[i] == 0) continue;
        advance(oscillator_step(omega_[i], sigma_[i], dt), next.z[i], next.z_dot[i]);
        if (std::abs(next.z[i]) < kNegligible && std::abs(next.z_dot[i]) < kNegligible)
            next.z[i] = next.z_dot[i] = 0;
    }
    return next;
}

OscillatorState BodyModel::kick(const Impulse& impulse) const noexcept {
    OscillatorState s;
    s.z_dot.head<6>() = gain_ * (linear_.strain_from_modal.transpose() *
                                 strain_impulse(impulse.impulse_body, impulse.point_body));
    const Stand& stand = definition_.stand;
    if (stand.hinged) {
        const Eigen::Vector3d moment = (impulse.point_body - stand.pivot_body).cross(impulse.impulse_body);
        s.z_dot[6] = stand.axis_body.dot(moment) / hinge_inertia_;
    }
    return s;
}

BodyPose pose_of(const Stand& stand, const ModalState& state) noexcept {
    BodyPose pose;
    if ((state.q.array() != 0).any() || (state.q_dot.array() != 0).any()) {
        Vector6d q, rate;
        for (int i = 0; i < 6; ++i) {
            const Limited l = limited(state.q[i], strain_limit(i));
            q[i] = l.value;
            rate[i] = l.slope * state.q_dot[i];
        }
        pose.deformation.matrix += strain_matrix(q);
        pose.deformation.inverse = pose.deformation.matrix.inverse();
        pose.deformation_rate = strain_matrix(rate);
    }
    if (stand.hinged) {
        const Eigen::Vector3d axis = stand.axis_body.normalized();
        const Limited swing = limited(state.swing, kSwingLimit);
        pose.hinge = Eigen::AngleAxisd(swing.value, axis).toRotationMatrix();
        pose.hinge_rate = swing.slope * state.swing_dot * axis;
    }
    return pose;
}

void MotionBounds::widen(const MotionBounds& other) noexcept {
    speed = speed.cwiseMax(other.speed);
    reach = reach.cwiseMax(other.reach);
    turn = std::max(turn, other.turn);
    swing = std::max(swing, other.swing);
}

// The energy 1/2 (z_dot^2 + omega^2 z^2) of a damped oscillator never grows; the limit's slope is at most 1.
MotionBounds BodyModel::bounds(const OscillatorState& s) const noexcept {
    const OscillatorVector top_rate =
        (s.z_dot.cwiseAbs2() + s.z.cwiseProduct(omega_).cwiseAbs2()).cwiseSqrt();
    const OscillatorVector top = top_rate.cwiseQuotient(omega_);
    const Matrix6d phi = linear_.strain_from_modal.cwiseAbs();
    Vector6d q = phi * top.head<6>();
    for (int i = 0; i < 6; ++i) q[i] = std::min(q[i], strain_limit(i));
    const Eigen::Vector3d& a = gauge_.semi_axes();
    return {strain_matrix(phi * top_rate.head<6>()) * a, strain_matrix(q) * a, top_rate[6],
            std::min(top[6], kSwingLimit)};
}

int zone_at(const BodyDefinition& body, const Eigen::Vector3d& rest_point) noexcept {
    const Eigen::Vector3d u = rest_point.cwiseQuotient(body.shape.semi_axes);
    const double radius = std::hypot(u.x(), u.z());
    for (std::size_t i = 0; i < body.zones.size(); ++i) {
        const Zone& zone = body.zones[i];
        if (radius >= zone.min_radius && radius <= zone.max_radius && u.y() >= zone.min_height &&
            u.y() <= zone.max_height) {
            return static_cast<int>(i);
        }
    }
    return -1;
}

Eigen::Matrix4d body_matrix(const BodyDefinition& body, const ModalState& state) {
    const BodyPose pose = pose_of(body.stand, state);
    const Eigen::Vector3d& pivot = body.stand.pivot_body;
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = pose.hinge * pose.deformation.matrix;
    m.topRightCorner<3, 1>() = pivot - pose.hinge * pivot;
    return body.world_from_body.matrix() * m;
}

}  // namespace sim
