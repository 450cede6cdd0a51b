#include "drummer/tip_path.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace tracking {
namespace {

constexpr double kRestShare = 0.6;                                // of the apex: where a stick waits
constexpr double kRestShares[] = {kRestShare, 0.7, 0.8, 0.9, 1};  // with little time it waits higher
constexpr double kPreparation = 0.2;                              // s, the rise from there to the apex
constexpr double kLift = 100;            // m/s^2, the most that a lift without rebound accelerates
constexpr double kMinimumJerk = 5.7735;  // largest second derivative, in way / duration^2
constexpr double kStrongestHeight = 0.75 * TipPath::kStrongest;  // shares of the whole
constexpr double kStrongestTravel = 0.2 * TipPath::kStrongest;
constexpr double kBefore = 2;  // s before the first stroke at which the path begins, at rest

/// Longest duration of a lift from rest that ends with acceleration -curvature without dipping first. At
/// curvature duration^2 <= 20 way the quintic rises all the way: its slope is proportional to u^2 (1 - u) (30
/// (1 - u) - k (3 - 5u)) with k = curvature duration^2 / 2 way.
double longest_lift(double way, double curvature) {
    return std::sqrt(20 * way / curvature);
}

/// The hand lifts as briskly as kLift allows, and no slower than it may before an apex of that curvature.
double lift_duration(double way, double curvature) {
    const double brisk = std::sqrt(kMinimumJerk * way / kLift);
    return curvature > 0 ? std::min(brisk, longest_lift(way, curvature)) : brisk;
}

/// The rebound carries the tip up by itself, or the hand lifts it, whichever is quicker.
double rise_duration(const TipPath::Departure& from, double top, double curvature) {
    const double way = std::max(top - from.height, 0.0);
    const double lift = lift_duration(way, curvature);
    return from.speed > 0 ? std::min(2 * way / from.speed, lift) : lift;
}

/// Bound of the acceleration on that way.
double rise_acceleration(const TipPath::Departure& from, double apex) {
    const double way = apex - from.height;
    return way > 0 ? std::max(kLift, 0.75 * from.speed * from.speed / way) : kLift;
}

/// Highest apex up to `rise` from which the stroke is reached in `time`; 0 if there is none.
double highest_apex(const TipPath::Departure& from, const StrokeShape& to, double time, double rise) {
    const auto needed = [&](double apex) {
        return rise_duration(from, apex, to.descent_acceleration(apex)) + to.descent_duration(apex);
    };
    double high = std::max(rise, to.least_apex() + rise / 2);
    if (needed(high) <= time) return high;
    double low = std::max(to.least_apex(), from.height);
    if (needed(low) > time) return 0;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (needed(middle) <= time ? low : high) = middle;
    }
    return low;
}

double minimum_jerk(double u) {
    return u * u * u * (10 + u * (-15 + 6 * u));
}

[[noreturn]] void refuse(const Stroke& stroke, const char* why) {
    std::ostringstream message;
    message << "score: found stroke of stick '" << stroke.stick << "' at " << stroke.t_s << " s " << why
            << ", expected strokes that one stick can play; give it more time or another stick";
    throw std::invalid_argument(message.str());
}

std::vector<StrokeShape> shapes_of(const std::vector<Stroke>& strokes, const DrummerParameters& parameters) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    std::vector<StrokeShape> shapes;
    for (std::size_t i = 0; i < strokes.size(); ++i) {
        const double before = i > 0 ? strokes[i].t_s - strokes[i - 1].t_s : kFar;
        const double after = i + 1 < strokes.size() ? strokes[i + 1].t_s - strokes[i].t_s : kFar;
        shapes.emplace_back(strokes[i], parameters, before, after);
    }
    return shapes;
}

}  // namespace

TipPath::TipPath(const std::vector<Stroke>& strokes, const DrummerParameters& parameters) {
    const std::vector<StrokeShape> shapes = shapes_of(strokes, parameters);
    add_travels(strokes, shapes);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
        const double begin = i > 0 ? shapes[i - 1].departure() : shapes[0].arrival() - kBefore;
        connect(i > 0 ? &shapes[i - 1] : nullptr, shapes[i], begin, parameters.rise_m, strokes[i]);
        shapes[i].append_contact(height_);
    }
    finish(shapes.back(), parameters.rise_m);
}

void TipPath::connect(const StrokeShape* from, const StrokeShape& to, double begin, double rise,
                      const Stroke& stroke) {
    const double time = to.arrival() - begin;
    const Departure departure{from ? from->departure_height() : kRestShare * rise,
                              from ? from->departure_speed() : 0};
    const double apex = highest_apex(departure, to, time, rise);
    if (apex <= 0) refuse(stroke, "too soon after the one before");
    if (to.descent_acceleration(apex) > kStrongestHeight) refuse(stroke, "whose speed its rise cannot give");
    if (rise_acceleration(departure, apex) > kStrongestHeight) refuse(stroke, "too soon after a faster one");
    if (apex < rise) ++lowered_;
    rise_to(departure, begin, apex, to);
    to.append_descent(height_, apex);
}

void TipPath::rise_to(const Departure& from, double begin, double apex, const StrokeShape& to) {
    const double end = to.arrival() - to.descent_duration(apex);
    const double curvature = to.descent_acceleration(apex);
    for (const double share : kRestShares) {
        const double rest = std::max(share * apex, from.height);
        const double rest_begin = begin + rise_duration(from, rest, 0);
        const double lift_begin = end - std::min(kPreparation, longest_lift(apex - rest, curvature));
        if (rest > apex || rest_begin > lift_begin) continue;
        height_.append(quintic(begin, rest_begin - begin, {from.height, from.speed, 0}, {rest, 0, 0}));
        height_.hold(rest_begin, lift_begin, rest);
        height_.append(quintic(lift_begin, end - lift_begin, {rest, 0, 0}, {apex, 0, -curvature}));
        return;
    }
    const double time = end - begin;
    const double bend = std::min(
        curvature, 20 * (apex - from.height) / (time * time));  // or the way would dip, see longest_lift
    height_.append(quintic(begin, time, {from.height, from.speed, 0}, {apex, 0, -bend}));
}

void TipPath::finish(const StrokeShape& last, double rise) {
    const Departure departure{last.departure_height(), last.departure_speed()};
    const double rest = std::max(kRestShare * rise, departure.height);
    const double duration = rise_duration(departure, rest, 0);
    if (duration > 0)
        height_.append(
            quintic(last.departure(), duration, {departure.height, departure.speed, 0}, {rest, 0, 0}));
}

void TipPath::add_travels(const std::vector<Stroke>& strokes, const std::vector<StrokeShape>& shapes) {
    const Stroke& first = strokes.front();
    const double start = shapes.front().arrival() - kBefore;
    travels_.push_back(
        {start, shapes.front().arrival(), first.target, first.target, first.normal, first.normal});
    for (std::size_t i = 1; i < strokes.size(); ++i) {
        const double begin = shapes[i - 1].departure();
        const double end = shapes[i].arrival();
        const double way = (strokes[i].target - strokes[i - 1].target).norm();
        if (!(end > begin) || kMinimumJerk * way > kStrongestTravel * (end - begin) * (end - begin))
            refuse(strokes[i], "too far from the one before for the time between");
        if (strokes[i].normal.dot(strokes[i - 1].normal) < -0.5)
            refuse(strokes[i], "facing away from the one before");
        travels_.push_back(
            {begin, end, strokes[i - 1].target, strokes[i].target, strokes[i - 1].normal, strokes[i].normal});
    }
}

const TipPath::Travel& TipPath::travel_at(double t) const {
    const auto later =
        std::upper_bound(travels_.begin(), travels_.end(), t,
                         [](double time, const Travel& travel) { return time < travel.begin; });
    return later == travels_.begin() ? travels_.front() : *(later - 1);
}

Eigen::Vector3d TipPath::foot_at(double t) const {
    const Travel& travel = travel_at(t);
    const double u = std::clamp((t - travel.begin) / (travel.end - travel.begin), 0.0, 1.0);
    return travel.from + minimum_jerk(u) * (travel.to - travel.from);
}

Eigen::Vector3d TipPath::at(double t) const {
    const Travel& travel = travel_at(t);
    const double u = minimum_jerk(std::clamp((t - travel.begin) / (travel.end - travel.begin), 0.0, 1.0));
    const Eigen::Vector3d normal = travel.normal_from + u * (travel.normal_to - travel.normal_from);
    return travel.from + u * (travel.to - travel.from) + height_.at(t) * normal.normalized();
}

}  // namespace tracking
