#pragma once
#include <array>
#include <vector>

namespace tracking {

/// A piece of a curve h(t) on [begin, end): a polynomial in u = (t - begin)/span, or a sine, h = amplitude sin(rate (t - begin) + phase).
struct HeightPiece {
    double begin = 0, end = 0;
    double span = 1;
    std::array<double, 6> coefficients{};
    double amplitude = 0, rate = 0, phase = 0;

    [[nodiscard]] double at(double t) const;
    [[nodiscard]] double slope_at(double t) const;
};

/// Quintic over `duration` from height h0 with slope v0 to h1 with slope v1, its second derivative 0 at both ends. With h1 - h0 =
/// (v0 + v1) duration / 2 the slope follows 3u^2 - 2u^3 and its steepest change is 1.5 |v1 - v0| / duration; with v0 = v1 = 0 it
/// is the minimum-jerk curve, whose largest second derivative is 5.7735 |h1 - h0| / duration^2.
[[nodiscard]] HeightPiece quintic(double begin, double duration, double h0, double v0, double h1, double v1);

/// Height of a tip above its target's surface over time, piece after piece without a gap; held still outside.
class HeightCurve {
public:
    /// Pieces are appended in order; one that does not last is left out.
    void append(const HeightPiece& piece);
    void hold(double begin, double end, double height);
    [[nodiscard]] double at(double t) const;

private:
    std::vector<HeightPiece> pieces_;
};

}  // namespace tracking
