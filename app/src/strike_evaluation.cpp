#include "strike_evaluation.h"

#include <stdexcept>

namespace app {

double HitScore::precision() const {
    return predicted > 0 ? static_cast<double>(matched) / predicted : 1;
}
double HitScore::recall() const {
    return true_contacts > 0 ? static_cast<double>(matched) / true_contacts : 1;
}
double HitScore::f1() const {
    const int both = true_contacts + predicted;
    return both > 0 ? 2.0 * matched / both : 1;
}
double HitScore::median_ms() const {
    return 0;
}
double HitScore::p95_ms() const {
    return 0;
}
double HitScore::false_per_min() const {
    return minutes > 0 ? false_notes() / minutes : 0;
}
double HitScore::false_per_min_without_cancel() const {
    return minutes > 0 ? false_without_cancel / minutes : 0;
}
void HitScore::add(const HitScore& other) {
    true_contacts += other.true_contacts;
}

// Stand-in: refuses rather than answer figures that nothing measured.
HitScore evaluate_strikes(const tracking::StickTrace&, std::span<const tracking::PoseSample>,
                          tracking::Predictor&, const StickGeometry&, const StrikeSurface&, double, double) {
    throw std::logic_error("error: found a surface for strikes, expected none: strikes are not scored yet");
}

}  // namespace app
