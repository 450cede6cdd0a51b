#include "modes/oscillator.h"

#include <cmath>

namespace sim {
namespace {

// e^(-sigma dt) times C and S; kept together because cosh alone overflows where the product is small.
struct Decayed {
    double cosine, sine;
};

Decayed decayed(double delta, double sigma, double dt) {
    const double x = delta * dt * dt;
    if (std::abs(x) < 1e-3) {  // truncation below x^4 / 8! = 3e-17
        const double e = std::exp(-sigma * dt);
        return {e * (1 - x / 2 * (1 - x / 12 * (1 - x / 30))),
                e * dt * (1 - x / 6 * (1 - x / 20 * (1 - x / 42)))};
    }
    if (delta > 0) {
        const double w = std::sqrt(delta), e = std::exp(-sigma * dt);
        return {e * std::cos(w * dt), e * std::sin(w * dt) / w};
    }
    const double w = std::sqrt(-delta);
    const double slow = std::exp((w - sigma) * dt), fast = std::exp(-(w + sigma) * dt);
    return {0.5 * (slow + fast), 0.5 * (slow - fast) / w};
}

}  // namespace

OscillatorStep oscillator_step(double omega, double sigma, double dt) noexcept {
    const Decayed e = decayed(omega * omega - sigma * sigma, sigma, dt);
    return {e.cosine + sigma * e.sine, e.sine, -omega * omega * e.sine, e.cosine - sigma * e.sine};
}

}  // namespace sim
