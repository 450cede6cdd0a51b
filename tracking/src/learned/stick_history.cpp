#include "learned/stick_history.h"

#include <algorithm>
#include <cmath>

#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kAgeStepS = 1.0 / 120, kWindowS = kAgeStepS * StickHistory::kAges.back();
constexpr double kSlowest = 0.05;   // [m/s]: motion below it is mostly the sensor's noise
constexpr double kMeanSpeed = 1.5;  // [m/s], where the logarithm is zero
constexpr double kPeriodS = 1.0 / 60, kMostPeriods = 4;
constexpr double kShaftShare = 0.3;  // how much the shaft counts beside the motion's energy in the frame
constexpr double kMostTurn = 2.5;    // [rad] of the fading rotation

double span_s(std::size_t k) {
    return kAgeStepS * (StickHistory::kAges[k + 1] - StickHistory::kAges[k]);
}

/// Second moments of horizontal velocities and what they have in common with the vertical one.
struct Moments {
    double xx = 0, zz = 0, xz = 0, xy = 0, zy = 0, square = 0;

    void add(const Eigen::Vector3d& v, double weight) {
        xx += weight * v.x() * v.x(), zz += weight * v.z() * v.z(), xz += weight * v.x() * v.z();
        xy += weight * v.x() * v.y(), zy += weight * v.z() * v.y(), square += weight * v.squaredNorm();
    }
};

/// The eigenvector in closed form: half the angle of (xx - zz, 2 xz).
void set_forward(PathFrame& frame, Moments m) {
    const Eigen::Vector3d& d = frame.direction;
    const double share = kShaftShare * m.square;
    m.xx += share * d.x() * d.x(), m.zz += share * d.z() * d.z(), m.xz += share * d.x() * d.z();
    const double half = (m.xx - m.zz) / 2, radius = std::sqrt(half * half + m.xz * m.xz);
    if (!(radius > 0)) return;
    frame.cosine = std::sqrt(std::max(0.0, (1 + half / radius) / 2));
    frame.sine = std::copysign(std::sqrt(std::max(0.0, (1 - half / radius) / 2)), m.xz);
    const double forward = frame.has_direction() ? frame.cosine * d.x() + frame.sine * d.z()
                                                 : -(frame.cosine * m.xy + frame.sine * m.zy);
    if (forward < 0) frame.cosine = -frame.cosine, frame.sine = -frame.sine;
}

/// Of the turn from one direction to another, as short as can be.
Eigen::Vector3d angular_velocity(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double dt_s) {
    const Eigen::Vector3d axis = from.cross(to);
    const double sine = axis.norm();
    if (!(sine > 0)) return Eigen::Vector3d::Zero();
    return std::atan2(sine, from.dot(to)) / (sine * dt_s) * axis;
}

}  // namespace

Eigen::Vector3f PathFrame::to_frame(const Eigen::Vector3d& v) const noexcept {
    return Eigen::Vector3d(cosine * v.x() + sine * v.z(), v.y(), cosine * v.z() - sine * v.x()).cast<float>();
}

Eigen::Vector3d PathFrame::to_world(const Eigen::Vector3d& v) const noexcept {
    return {cosine * v.x() - sine * v.z(), v.y(), sine * v.x() + cosine * v.z()};
}

Eigen::Vector3d PathFrame::faded_position(double lead_s) const noexcept {
    return position + fading_way(lead_s) * velocity;
}

Eigen::Vector3d PathFrame::faded_direction(double lead_s) const noexcept {
    Eigen::Vector3d turn = fading_way(lead_s) * angular_velocity;
    if (const double angle = turn.norm(); angle > kMostTurn) turn *= kMostTurn / angle;
    return exponential(turn) * direction;
}

double fading_way(double lead_s) noexcept {
    return -std::expm1(-kFadingRate * lead_s) / kFadingRate;
}

void StickHistory::push(const PoseSample& sample) noexcept {
    const Eigen::Vector3d known = held_ > 0 ? back(0).direction : Eigen::Vector3d::Zero();
    newest_ = (newest_ + 1) % kCapacity;
    held_ = std::min(held_ + 1, kCapacity);
    Point& newest = ring_[newest_];
    newest = {sample.t_s, sample.position, known};
    if (!sample.has_orientation) return;
    newest.direction = sample.orientation.normalized() * shaft_;
    if (!known.isZero(0)) return;
    for (std::size_t age = 1; age < held_; ++age)  // as if the shaft had been at rest before it was known
        ring_[(newest_ + kCapacity - age) % kCapacity].direction = newest.direction;
}

bool StickHistory::find(double t_s, Eigen::Vector3d& position, Eigen::Vector3d& direction) const noexcept {
    std::size_t age = 0;  // of the sample not later than t_s
    while (age < held_ && back(age).t_s > t_s) ++age;
    if (age == held_ || (age == 0 && back(0).t_s < t_s)) return false;
    const Point &a = back(age), &b = back(age > 0 ? age - 1 : 0);
    const double share = age > 0 ? (t_s - a.t_s) / (b.t_s - a.t_s) : 0;
    position = a.position + share * (b.position - a.position);
    direction = a.direction + share * (b.direction - a.direction);
    return true;
}

void StickHistory::find_velocities(Spans& point, Spans& second) const noexcept {
    Point younger = back(0);
    const bool directed = !younger.direction.isZero(0);
    if (!directed) second.fill(Eigen::Vector3d::Zero());
    const double now_s = younger.t_s;
    std::size_t i = 0;  // the age lies between back(i + 1) and back(i)
    for (std::size_t k = 0; k < kSpans; ++k) {
        const double t_s = now_s - kAgeStepS * kAges[k + 1];
        while (i + 2 < held_ && back(i + 1).t_s > t_s) ++i;
        const Point &b = back(i), &a = back(i + 1);
        const double share = std::clamp((t_s - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0);
        const Eigen::Vector3d position = a.position + share * (b.position - a.position);
        point[k] = (younger.position - position) / span_s(k);
        younger.position = position;
        if (!directed) continue;
        const Eigen::Vector3d direction = a.direction + share * (b.direction - a.direction);
        second[k] = kLever / span_s(k) * (younger.direction - direction);
        younger.direction = direction;
    }
}

PathFrame StickHistory::look(Inputs& inputs) const noexcept {
    Spans point, second;
    find_velocities(point, second);
    Moments moments;
    for (std::size_t k = 0; k < kSpans; ++k) {
        moments.add(point[k], span_s(k));
        moments.add(point[k] + second[k], span_s(k));
    }
    PathFrame frame;
    frame.position = back(0).position;
    frame.direction = back(0).direction;
    frame.speed = std::sqrt(kSlowest * kSlowest + moments.square / (2 * kWindowS));
    set_forward(frame, moments);
    const double past_s = span_s(0) + span_s(1);
    frame.velocity = (span_s(0) * point[0] + span_s(1) * point[1]) / past_s;
    if (frame.has_direction()) {
        const Eigen::Vector3d way = (span_s(0) * second[0] + span_s(1) * second[1]) / kLever;
        frame.angular_velocity = angular_velocity(frame.direction - way, frame.direction, past_s);
    }

    const double unit = 1 / frame.speed;
    Eigen::Index next = 0;
    const auto put = [&](const Eigen::Vector3f& v) { inputs.segment<3>(next) = v, next += 3; };
    for (const Eigen::Vector3d& v : point) put(frame.to_frame(unit * v));
    if (frame.has_direction()) {
        for (const Eigen::Vector3d& v : second) put(frame.to_frame(unit * v));
        put(frame.to_frame(frame.direction));
    } else {
        constexpr auto kOfShaft = static_cast<Eigen::Index>(3 * (kSpans + 1));
        inputs.segment<kOfShaft>(next).setZero();
        next += kOfShaft;
    }
    inputs[next++] = frame.has_direction() ? 1.0F : 0.0F;
    inputs[next++] = static_cast<float>(std::log(frame.speed / kMeanSpeed));
    for (std::size_t k = 0; k < kPeriods; ++k)
        inputs[next++] = static_cast<float>(
            k + 1 < held_ ? std::min(kMostPeriods, (back(k).t_s - back(k + 1).t_s) / kPeriodS)
                          : kMostPeriods);
    inputs[next] = static_cast<float>(std::min(1.0, (back(0).t_s - back(held_ - 1).t_s) / kWindowS));
    return frame;
}

}  // namespace tracking
