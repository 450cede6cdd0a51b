#include "stroke_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tracking {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;
constexpr double kShareOfGap = 0.25;
constexpr double kLeastApex = 0.002;  // m above the turn of a feint or the surface

}  // namespace

StrokeShape::StrokeShape(const Stroke& stroke, const DrummerParameters& parameters, double gap_before, double gap_after)
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

double StrokeShape::least_apex() const { return (feint_ ? turn_height_ : 0) + kLeastApex; }

double StrokeShape::brake_start(const HeightPiece& downstroke) const {
    double low = 0;
    double high = downstroke.span;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        const double v = downstroke.slope_at(middle);
        const double way = 0.75 * v * v / kBrake;
        (downstroke.at(middle) - turn_height_ > way ? low : high) = middle;
    }
    return low;
}

double StrokeShape::descent_duration(double apex) const {
    const double full = 2 * apex / speed_;
    if (!feint_) return full;
    const HeightPiece downstroke = quintic(0, full, apex, 0, 0, -speed_);
    const double start = brake_start(downstroke);
    return start + 1.5 * std::abs(downstroke.slope_at(start)) / kBrake;
}

double StrokeShape::descent_acceleration(double apex) const { return 0.75 * speed_ * speed_ / apex; }

void StrokeShape::append_descent(HeightCurve& curve, double apex) const {
    const double begin = arrival_ - descent_duration(apex);
    HeightPiece downstroke = quintic(begin, 2 * apex / speed_, apex, 0, 0, -speed_);
    if (!feint_) {
        downstroke.end = arrival_;
        curve.append(downstroke);
        return;
    }
    HeightPiece local = downstroke;
    local.begin = 0;
    const double start = brake_start(local);
    const double v = local.slope_at(start);
    downstroke.end = begin + start;
    curve.append(downstroke);
    if (downstroke.end < arrival_)
        curve.append(quintic(downstroke.end, arrival_ - downstroke.end, local.at(start), v, turn_height_, 0));
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
