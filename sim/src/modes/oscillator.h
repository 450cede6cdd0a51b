#pragma once

namespace sim {

/// Exact step of z'' + 2 sigma z' + omega^2 z = 0 over dt:  z <- a z + b z',  z' <- c z + d z'.
///   Delta = omega^2 - sigma^2,  C = cos(sqrt(Delta) dt),  S = sin(sqrt(Delta) dt) / sqrt(Delta)
///   a = e^(-sigma dt) (C + sigma S),  b = e^(-sigma dt) S,  c = -omega^2 b,  d = e^(-sigma dt) (C - sigma S)
/// For Delta < 0 C and S are of cosh and sinh of sqrt(-Delta) dt.
/// Near critical damping C and S come from their series in Delta dt^2, so no digits are lost there.
struct OscillatorStep {
    double a, b, c, d;
};

/// omega [rad/s] > 0, sigma [1/s] >= 0, dt [s] >= 0. Stable for every dt.
[[nodiscard]] OscillatorStep oscillator_step(double omega, double sigma, double dt) noexcept;

inline void advance(const OscillatorStep& step, double& z, double& z_dot) noexcept {
    const double next = step.a * z + step.b * z_dot;
    z_dot = step.c * z + step.d * z_dot;
    z = next;
}

}  // namespace sim
