#pragma once
#include "drummer/height_curve.h"
#include "tracking/drummer.h"

namespace tracking {

/// The part of a stroke near its lowest point, as heights above the struck surface.
///
///   hit    press   h = -d sin(s tau / d)      from the surface at speed s to depth d: lasts (pi/2) d / s
///          release h = -d cos(e s tau / d)    back to the surface at speed e s: lasts (pi/2) d / (e s)
///          (a linear spring met at s and left at e s: half-sines of force, as in Hertz's impact made linear)
///   feint  brake   speed v to 0 along 3u^2 - 2u^3 over 1.5 v / kBrake, so that it decelerates by at most
///                  kBrake
///
/// The downstroke before either is the same: from the apex H at rest to the surface at speed s over 2 H / s,
/// with the constant acceleration s^2 / 2 H. A feint leaves it where the way left down to the turn is the way
/// that braking takes.
class StrokeShape {
public:
    static constexpr double kBrake = 500;  // m/s^2

    /// `gap_before`, `gap_after`: to the stick's neighbouring strokes [s]; a press or release takes at most a
    /// quarter of its gap, so slow hits that follow each other closely go less deep.
    StrokeShape(const Stroke& stroke, const DrummerParameters& parameters, double gap_before,
                double gap_after);

    /// Times at which the tip reaches the lowest part (the surface, or for feints the lowest point) and
    /// leaves it.
    [[nodiscard]] double arrival() const { return arrival_; }
    [[nodiscard]] double departure() const { return departure_; }
    /// Height and upward speed on leaving.
    [[nodiscard]] double departure_height() const { return feint_ ? turn_height_ : 0; }
    [[nodiscard]] double departure_speed() const { return rebound_; }
    /// Lowest apex from which the stroke can be played.
    [[nodiscard]] double least_apex() const;

    /// How long the way from an apex to arrival() takes.
    [[nodiscard]] double descent_duration(double apex) const;
    /// Acceleration with which it starts.
    [[nodiscard]] double descent_acceleration(double apex) const;
    void append_descent(HeightCurve& curve, double apex) const;
    void append_contact(HeightCurve& curve) const;

private:
    /// The unfeinted downstroke from an apex.
    [[nodiscard]] HeightPiece downstroke(double apex) const;
    /// Speed at which a feint's downstroke from `apex` starts to brake.
    [[nodiscard]] double brake_speed(double apex) const;

    bool feint_;
    double t_;
    double speed_;
    double turn_height_;
    double depth_ = 0;
    double rebound_ = 0;
    double arrival_;
    double departure_;
};

}  // namespace tracking
