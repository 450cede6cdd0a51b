#include "drummer/stroke_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tracking {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;
constexpr double kShareOfGap = 0.25;
constexpr double kLeastApex = 0.002;  // m above the turn of a feint or the surface

}  // namespace

StrokeShape::StrokeShape(const Stroke& stroke, const DrummerParameters& parameters, double gap_before,
                         double gap_after)
    : feint_(stroke.kind == StrokeKind::feint),
      t_(stroke.t_s),
      speed_(stroke.speed_mps),
      turn_height_(stroke.turn_height_m),
      arrival_(stroke.t_s),
      departure_(stroke.t_s) {
    if (feint_) return;
    rebound_ = parameters.restitution * speed_;
    depth_ = std::min({parameters.depth_m, kShareOfGap * gap_before * speed_ / kQuarter,
                       kShareOfGap * gap_after * rebound_ / kQuarter});
    arrival_ = t_ - kQuarter * depth_ / speed_;
    departure_ = t_ + kQuarter * depth_ / rebound_;
}

double StrokeShape::least_apex() const {
    return (feint_ ? turn_height_ : 0) + kLeastApex;
}

HeightPiece StrokeShape::downstroke(double apex) const {
    HeightPiece piece;
    piece.span = 2 * apex / speed_;
    piece.coefficients = {apex, 0, -apex, 0, 0, 0};
    return piece;
}

double StrokeShape::brake_speed(double apex) const {
    // v^2 / 2a has been fallen when braking starts, 0.75 v^2 / kBrake is left then.
    const double way = apex - turn_height_;
    return std::sqrt(way / (0.5 / descent_acceleration(apex) + 0.75 / kBrake));
}

double StrokeShape::descent_duration(double apex) const {
    if (!feint_) return 2 * apex / speed_;
    const double v = brake_speed(apex);
    return v / descent_acceleration(apex) + 1.5 * v / kBrake;
}

double StrokeShape::descent_acceleration(double apex) const {
    return speed_ * speed_ / (2 * apex);
}

void StrokeShape::append_descent(HeightCurve& curve, double apex) const {
    HeightPiece down = downstroke(apex);
    down.begin = arrival_ - descent_duration(apex);
    const double v = feint_ ? brake_speed(apex) : 0;
    const double brake_begin = arrival_ - 1.5 * v / kBrake;
    down.end = brake_begin;
    curve.append(down);
    if (feint_)
        curve.append(quintic(brake_begin, arrival_ - brake_begin, {down.at(brake_begin), -v, 0},
                             {turn_height_, 0, 0}));
}

void StrokeShape::append_contact(HeightCurve& curve) const {
    if (feint_ || depth_ <= 0) return;
    HeightPiece press;
    press.begin = arrival_;
    press.end = t_;
    press.amplitude = -depth_;
    press.rate = speed_ / depth_;
    curve.append(press);
    HeightPiece release;
    release.begin = t_;
    release.end = departure_;
    release.amplitude = -depth_;
    release.rate = rebound_ / depth_;
    release.phase = kQuarter;
    curve.append(release);
}

}  // namespace tracking
