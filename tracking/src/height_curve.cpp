#include "height_curve.h"

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
    for (std::size_t i = coefficients.size(); i-- > 1;) sum = sum * u + static_cast<double>(i) * coefficients[i];
    return sum / span + amplitude * rate * std::cos(rate * (t - begin) + phase);
}

HeightPiece quintic(double begin, double duration, double h0, double v0, double h1, double v1) {
    const double rise = h1 - h0;
    const double a = v0 * duration;
    const double b = v1 * duration;
    HeightPiece piece;
    piece.begin = begin;
    piece.end = begin + duration;
    piece.span = duration;
    piece.coefficients = {h0, a, 0, 10 * rise - 6 * a - 4 * b, -15 * rise + 8 * a + 7 * b, 6 * rise - 3 * a - 3 * b};
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
    const auto later = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                        [](double time, const HeightPiece& piece) { return time < piece.begin; });
    const HeightPiece& piece = later == pieces_.begin() ? pieces_.front() : *(later - 1);
    return piece.at(std::clamp(t, piece.begin, piece.end));
}

}  // namespace tracking
