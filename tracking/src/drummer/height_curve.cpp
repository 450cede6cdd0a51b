#include "drummer/height_curve.h"

#include <algorithm>
#include <cmath>

namespace tracking {

double HeightPiece::at(double t) const {
    const double u = (t - begin) / span;
    double sum = 0;
    for (std::size_t i = coefficients.size(); i-- > 0;) sum = sum * u + coefficients[i];
    return sum + amplitude * std::sin(rate * (t - begin) + phase);
}

double HeightPiece::slope_at(double t) const {
    const double u = (t - begin) / span;
    double sum = 0;
    for (std::size_t i = coefficients.size(); i-- > 1;)
        sum = sum * u + static_cast<double>(i) * coefficients[i];
    return sum / span + amplitude * rate * std::cos(rate * (t - begin) + phase);
}

HeightPiece quintic(double begin, double duration, const HeightEnd& from, const HeightEnd& to) {
    const double way = to.height - from.height;
    const double v0 = from.slope * duration;
    const double v1 = to.slope * duration;
    const double a0 = from.curvature * duration * duration / 2;
    const double a1 = to.curvature * duration * duration / 2;
    HeightPiece piece;
    piece.begin = begin;
    piece.end = begin + duration;
    piece.span = duration;
    piece.coefficients = {from.height,
                          v0,
                          a0,
                          10 * way - 6 * v0 - 4 * v1 - 3 * a0 + a1,
                          -15 * way + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1,
                          6 * way - 3 * v0 - 3 * v1 - a0 + a1};
    return piece;
}

void HeightCurve::append(const HeightPiece& piece) {
    if (piece.end > piece.begin) pieces_.push_back(piece);
}

void HeightCurve::hold(double begin, double end, double height) {
    HeightPiece piece;
    piece.begin = begin;
    piece.end = end;
    piece.coefficients[0] = height;
    append(piece);
}

double HeightCurve::at(double t) const {
    const auto later =
        std::upper_bound(pieces_.begin(), pieces_.end(), t,
                         [](double time, const HeightPiece& piece) { return time < piece.begin; });
    const HeightPiece& piece = later == pieces_.begin() ? pieces_.front() : *(later - 1);
    return piece.at(std::clamp(t, piece.begin, piece.end));
}

}  // namespace tracking
