#include "tracking/plausibility.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSmallRange = 0.1, kSlow = 0.5, kLargeRange = 3, kFast = 30;  // m, m/s
constexpr std::size_t kFewestValues = 1000;  // accelerations, and pairs of poses, for a judgement
constexpr double kStrongestShare = 0.002;    // share of the accelerations
constexpr double kOneSided = 0.45;           // length of the mean of unit vectors
constexpr double kPair = 1.0 / 30;           // s between poses that are compared
constexpr double kMostlyExplained = 0.5, kMuchBetter = 0.25;
constexpr std::size_t kFirstMirrored = 2, kLastMirrored = 4;  // among readings()
constexpr double kWrongSide = 0.05, kShortestArm = 0.03;      // m
constexpr double kAhead = 0.2;  // length of the mean of unit vectors, horizontally
constexpr double kMostOfTheTime = 0.75;

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return text;
}

/// Linear between the order statistics (Hyndman and Fan 1996, definition 7).
/// `values` is not empty.
double quantile(std::vector<double> values, double p) {
    std::sort(values.begin(), values.end());
    const double at = p * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at), above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], at - static_cast<double>(below));
}

/// Range along the axis of the largest, of the middle 98 % of positions [m].
double range_of(const StickTrace& stick) {
    double range = 0;
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<double> x;
        for (const PoseSample& sample : stick.samples) x.push_back(sample.position[axis]);
        range = std::max(range, quantile(x, 0.99) - quantile(x, 0.01));
    }
    return range;
}

/// Speed that one per cent of the steps exceed [m/s].
double speed_of(const StickTrace& stick) {
    std::vector<double> speeds;
    for (std::size_t i = 1; i < stick.samples.size(); ++i) {
        const PoseSample &a = stick.samples[i - 1], &b = stick.samples[i];
        speeds.push_back((b.position - a.position).norm() / (b.t_s - a.t_s));
    }
    return quantile(speeds, 0.99);
}

}  // namespace

std::optional<std::string> implausible_units(const Trace& trace) {
    double range = 0, speed = 0;
    for (const StickTrace& stick : trace.sticks) {
        range = std::max(range, range_of(stick));
        speed = std::max(speed, speed_of(stick));
    }
    const std::string evidence = "positions range over " + number(range) +
                                 " m, the fastest per cent of steps over " + number(speed) + " m/s: ";
    if (range > kLargeRange || speed > kFast)
        return evidence + "more than hands do; are the units (m, cm, mm, s, ms) right?";
    if (range < kSmallRange && speed < kSlow)
        return evidence + "less than hands that drum; are the units (m, cm, mm, s, ms) right?";
    return std::nullopt;
}

namespace {

Vector3d tip_of(const PoseSample& sample, const Trace& trace) {
    return sample.position + sample.orientation * trace.tip.value_or(Vector3d::Zero());
}

std::vector<Vector3d> accelerations(const Trace& trace) {
    std::vector<Vector3d> all;
    for (const StickTrace& stick : trace.sticks)
        for (std::size_t i = 2; i < stick.samples.size(); ++i) {
            const PoseSample &a = stick.samples[i - 2], &b = stick.samples[i - 1], &c = stick.samples[i];
            if (c.t_s - a.t_s > kGapS) continue;
            const Vector3d before = (tip_of(b, trace) - tip_of(a, trace)) / (b.t_s - a.t_s);
            const Vector3d after = (tip_of(c, trace) - tip_of(b, trace)) / (c.t_s - b.t_s);
            all.push_back((after - before) * 2 / (c.t_s - a.t_s));
        }
    return all;
}

void judge_gravity(const Trace& trace, std::vector<std::string>& lines) {
    std::vector<Vector3d> all = accelerations(trace);
    if (all.size() < kFewestValues) return;
    const auto count =
        std::max<std::ptrdiff_t>(20, std::lround(kStrongestShare * static_cast<double>(all.size())));
    std::nth_element(all.begin(), all.begin() + count, all.end(),
                     [](const Vector3d& a, const Vector3d& b) { return a.squaredNorm() > b.squaredNorm(); });
    Vector3d mean = Vector3d::Zero();
    for (std::ptrdiff_t i = 0; i < count; ++i)
        mean += all[static_cast<std::size_t>(i)].stableNormalized() / static_cast<double>(count);
    if (mean.norm() < kOneSided || mean.y() >= 0.5 * mean.norm()) return;
    const Vector3d side = mean.normalized();
    lines.push_back(
        "the tips are stopped from the side (" + number(side.x()) + ", " + number(side.y()) + ", " +
        number(side.z()) + "), mean of the strongest " + std::to_string(count) +
        " accelerations, not from below: is the axis that points up right, or the tip not given?");
}

/// Another way in which the same components may have been meant.
struct OtherReading {
    const char* what;
    std::function<Matrix3d(const Quaterniond&)> matrix;
};

Matrix3d mirrored(const Quaterniond& q, int axis) {
    Matrix3d mirror = Matrix3d::Identity();
    mirror(axis, axis) = -1;
    return mirror * q.toRotationMatrix() * mirror;
}

Matrix3d turned(const Quaterniond& q, double quarter) {
    return Eigen::AngleAxisd(quarter * std::numbers::pi / 2, Vector3d::UnitX()) * q.toRotationMatrix();
}

const std::vector<OtherReading>& readings() {
    static const std::vector<OtherReading> all = {
        {"as given", [](const Quaterniond& q) { return q.toRotationMatrix(); }},
        {"inverse (world to body)", [](const Quaterniond& q) { return q.conjugate().toRotationMatrix(); }},
        {"mirrored in x", [](const Quaterniond& q) { return mirrored(q, 0); }},
        {"mirrored in y", [](const Quaterniond& q) { return mirrored(q, 1); }},
        {"mirrored in z", [](const Quaterniond& q) { return mirrored(q, 2); }},
        {"with its components in the order x y z w",
         [](const Quaterniond& q) { return Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix(); }},
        {"with components meant as w x y z",
         [](const Quaterniond& q) { return Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix(); }},
        {"with z up", [](const Quaterniond& q) { return turned(q, -1); }},
        {"with y up", [](const Quaterniond& q) { return turned(q, 1); }},
    };
    return all;
}

/// Pairs of poses of a stick about 1/30 s apart, by index.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const StickTrace& stick) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    const std::vector<PoseSample>& s = stick.samples;
    for (std::size_t i = 0, j = 0; i < s.size(); ++i) {
        while (j < s.size() && s[j].t_s < s[i].t_s + kPair) ++j;
        if (j == s.size()) break;
        if (s[j].t_s - s[i].t_s <= kGapS && s[i].has_orientation && s[j].has_orientation)
            pairs.emplace_back(i, j);
    }
    return pairs;
}

/// How much of a stick's motion is turning about a point fixed in it.
struct Turning {
    Vector3d pivot = Vector3d::Zero();  ///< r, from the tracked point, body frame [m]
    double all = 0, left = 0;           ///< sums of squared motions; what r leaves of them [m^2]
    std::size_t count = 0;
};

Turning turning_of(const StickTrace& stick, const OtherReading& reading) {
    Turning turning;
    Matrix3d normal = 1e-12 * Matrix3d::Identity();  // keeps r finite where the stick does not turn
    Vector3d right = Vector3d::Zero();
    for (const auto& [i, j] : pairs_of(stick)) {
        const Vector3d way = stick.samples[j].position - stick.samples[i].position;
        const Matrix3d turn =
            reading.matrix(stick.samples[j].orientation) - reading.matrix(stick.samples[i].orientation);
        normal += turn.transpose() * turn;
        right -= turn.transpose() * way;
        turning.all += way.squaredNorm();
        ++turning.count;
    }
    turning.pivot = normal.ldlt().solve(right);
    turning.left = turning.all - right.dot(turning.pivot);
    return turning;
}

/// Share of the sum of squared motions that turning about a point of each stick explains.
double explained(const Trace& trace, const OtherReading& reading, std::size_t& count) {
    double all = 0, left = 0;
    count = 0;
    for (const StickTrace& stick : trace.sticks) {
        const Turning turning = turning_of(stick, reading);
        all += turning.all;
        left += turning.left;
        count += turning.count;
    }
    return all > 0 ? 1 - left / all : 0;
}

std::string per_cent(double share) {
    return std::to_string(std::lround(100 * share)) + " %";
}

void judge_orientation(const Trace& trace, std::vector<std::string>& lines) {
    std::size_t count = 0;
    const double given = explained(trace, readings().front(), count);
    if (count < kFewestValues) return;
    double best = 0;
    std::size_t which = 0;
    for (std::size_t i = 1; i < readings().size(); ++i) {
        const double share = explained(trace, readings()[i], count);
        if (share > best) best = share, which = i;
    }
    if (best < kMostlyExplained || best < given + kMuchBetter) return;
    lines.push_back(
        "turning about the hand explains " + per_cent(given) + " of the motion, and " + per_cent(best) +
        " if the orientation is read " + readings()[which].what +
        (which >= kFirstMirrored && which <= kLastMirrored
             ? ": do positions and orientations differ in handedness (left-handed data, as Unity's and "
               "Unreal's, need a frame, or signs in the map, for both)?"
             : ": are its convention and the axes' handedness right?"));
}

const StickTrace* stick_named(const Trace& trace, const char* name) {
    for (const StickTrace& stick : trace.sticks)
        if (stick.name == name) return &stick;
    return nullptr;
}

/// The body axis from hand to tip: the trace's shaft, else away from the point that the stick mostly turns
/// about.
std::optional<Vector3d> shaft_of(const StickTrace& stick, const Trace& trace) {
    if (trace.shaft) return trace.shaft;
    const Turning turning = turning_of(stick, readings().front());
    const bool turns = turning.left < (1 - kMostlyExplained) * turning.all;
    if (!turns || turning.pivot.norm() < kShortestArm) return std::nullopt;
    return -turning.pivot.normalized();
}

/// Where a shaft points, averaged with the square of the speed of its turning as weight: sticks at rest point
/// anywhere, back over the shoulder too, but who swings one swings it ahead.
Vector3d mean_while_swinging(const StickTrace& stick, const Vector3d& shaft) {
    Vector3d sum = Vector3d::Zero();
    double weights = 0;
    for (std::size_t i = 1; i < stick.samples.size(); ++i) {
        const PoseSample &a = stick.samples[i - 1], &b = stick.samples[i];
        if (!a.has_orientation || !b.has_orientation || b.t_s - a.t_s > kGapS) continue;
        const Vector3d before = a.orientation * shaft, after = b.orientation * shaft;
        const double weight = (after - before).squaredNorm() / (b.t_s - a.t_s);
        sum += weight * (before + after) / 2;
        weights += weight;
    }
    return weights > 0 ? (sum / weights).eval() : sum;
}

/// How far b is from a along an axis: at each sample of a, from the sample of b before it.
std::vector<double> apart_along(const StickTrace& a, const StickTrace& b, const Vector3d& axis) {
    std::vector<double> apart;
    std::size_t k = 0;
    for (const PoseSample& sample : a.samples) {
        while (k + 1 < b.samples.size() && b.samples[k + 1].t_s <= sample.t_s) ++k;
        if (std::abs(b.samples[k].t_s - sample.t_s) <= kGapS)
            apart.push_back((b.samples[k].position - sample.position).dot(axis));
    }
    return apart;
}

void judge_sides(const Trace& trace, std::vector<std::string>& lines) {
    const StickTrace *left = stick_named(trace, "left"), *right = stick_named(trace, "right");
    if (left == nullptr || right == nullptr) return;
    const std::optional<Vector3d> left_shaft = shaft_of(*left, trace), right_shaft = shaft_of(*right, trace);
    if (!left_shaft || !right_shaft) return;
    Vector3d ahead =
        (mean_while_swinging(*left, *left_shaft) + mean_while_swinging(*right, *right_shaft)) / 2;
    ahead.y() = 0;
    if (ahead.norm() < kAhead) return;
    const Vector3d to_the_right = ahead.normalized().cross(Vector3d::UnitY());
    const std::vector<double> apart = apart_along(*left, *right, to_the_right);
    if (apart.size() < kFewestValues || quantile(apart, 0.5) > -kWrongSide) return;
    const auto wrong = std::count_if(apart.begin(), apart.end(), [](double way) { return way < 0; });
    const double share = static_cast<double>(wrong) / static_cast<double>(apart.size());
    if (share < kMostOfTheTime) return;
    lines.push_back(
        "stick left lies to the right of stick right for " + per_cent(share) + " of the time, by " +
        number(-quantile(apart, 0.5)) +
        " m in the median, seen the way their shafts point while they swing: are the data left-handed "
        "(as Unity's and Unreal's; say their frame), an axis mirrored, or the names swapped?");
}

}  // namespace

std::vector<std::string> implausible(const Trace& trace) {
    std::vector<std::string> lines;
    if (std::optional<std::string> units = implausible_units(trace)) lines.push_back(*std::move(units));
    judge_gravity(trace, lines);
    judge_orientation(trace, lines);
    judge_sides(trace, lines);
    return lines;
}

}  // namespace tracking
