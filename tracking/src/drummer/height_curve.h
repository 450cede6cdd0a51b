#pragma once
#include <array>
#include <vector>

namespace tracking {

/// A piece of a curve h(t) on [begin, end): a polynomial in u = (t - begin)/span, or a sine, h = amplitude
/// sin(rate (t - begin) + phase).
struct HeightPiece {
    double begin = 0, end = 0;
    double span = 1;
    std::array<double, 6> coefficients{};
    double amplitude = 0, rate = 0, phase = 0;

    [[nodiscard]] double at(double t) const;
    [[nodiscard]] double slope_at(double t) const;
};

/// Height, slope and second derivative at an end of a piece.
struct HeightEnd {
    double height = 0, slope = 0, curvature = 0;
};

/// Quintic over `duration` between two ends. Without curvature, and with a way of (v0 + v1) duration / 2, its
/// slope follows 3u^2 - 2u^3 and changes by at most 1.5 |v1 - v0| / duration; without slopes too it is the
/// minimum-jerk curve, whose largest second derivative is 5.7735 |way| / duration^2.
[[nodiscard]] HeightPiece quintic(double begin, double duration, const HeightEnd& from, const HeightEnd& to);

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
