#include "trace/random_stream.h"

#include <cmath>
#include <numbers>

namespace tracking {
namespace {

/// Finaliser of splitmix64 (Steele, Lea, Flood 2014): a bijection whose output bits all depend on all input
/// bits.
std::uint64_t mixed(std::uint64_t x) noexcept {
    x += 0x9E3779B97F4A7C15U;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
    return x ^ (x >> 31);
}

}  // namespace

double RandomStream::uniform() {
    return (static_cast<double>(engine_() >> 11) + 1) * 0x1p-53;
}

double RandomStream::normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
}

Eigen::Vector3d RandomStream::normal_vector(double sigma) {
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = sigma * normal();
    return v;
}

std::uint64_t mixed_seed(std::uint64_t seed, std::uint64_t a, std::uint64_t b) noexcept {
    return mixed(mixed(mixed(seed) ^ a) ^ b);
}

}  // namespace tracking
