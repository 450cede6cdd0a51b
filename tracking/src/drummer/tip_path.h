#pragma once
#include <vector>

#include "drummer/height_curve.h"
#include "drummer/stroke_shape.h"
#include "tracking/drummer.h"

namespace tracking {

/// Path of one stick's tip through its strokes: foot(t) + h(t) normal(t).
///
/// foot and normal go from target to target along minimum-jerk curves between leaving one and reaching the
/// next, and rest during contact, so that the tip meets a surface along its normal. h rises from a stroke to
/// the next one's apex and comes down (StrokeShape), through the apex with the downstroke's acceleration;
/// with time to spare it first rests at 0.6 of the apex or more; without, the apex is lowered until the way
/// fits. Tip position is C1; apart from contact its acceleration stays below kStrongest.
class TipPath {
public:
    static constexpr double kStrongest = 2000;  // m/s^2

    /// `strokes`: of one stick, sorted, checked. Throws std::invalid_argument for strokes that no stick can
    /// connect.
    TipPath(const std::vector<Stroke>& strokes, const DrummerParameters& parameters);

    /// Point on the way between targets, below the tip.
    [[nodiscard]] Eigen::Vector3d foot_at(double t) const;
    [[nodiscard]] Eigen::Vector3d at(double t) const;
    /// How many strokes had to start lower than the parameters' rise.
    [[nodiscard]] int lowered() const { return lowered_; }

    /// Where a way up begins: height, and speed upward.
    struct Departure {
        double height, speed;
    };

private:
    struct Travel {
        double begin, end;
        Eigen::Vector3d from, to, normal_from, normal_to;
    };

    void connect(const StrokeShape* from, const StrokeShape& to, double begin, double rise,
                 const Stroke& stroke);
    void rise_to(const Departure& from, double begin, double apex, const StrokeShape& to);
    void finish(const StrokeShape& last, double rise);
    void add_travels(const std::vector<Stroke>& strokes, const std::vector<StrokeShape>& shapes);
    [[nodiscard]] const Travel& travel_at(double t) const;

    HeightCurve height_;
    std::vector<Travel> travels_;
    int lowered_ = 0;
};

}  // namespace tracking
