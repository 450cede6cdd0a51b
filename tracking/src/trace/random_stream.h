#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace tracking {

/// Random numbers that are the same with every standard library: its distributions differ, its
/// mt19937_64 does not. Normal deviates by Box and Muller's transform.
class RandomStream {
public:
    explicit RandomStream(std::uint64_t seed) : engine_(seed) {}

    /// Uniform in (0, 1].
    double uniform();
    /// Standard normal.
    double normal();
    /// Three independent normal deviates of standard deviation `sigma`.
    Eigen::Vector3d normal_vector(double sigma);

private:
    std::mt19937_64 engine_;
};

/// A seed that depends on all three, so that streams of neighbouring numbers have nothing in common.
[[nodiscard]] std::uint64_t mixed_seed(std::uint64_t seed, std::uint64_t a, std::uint64_t b) noexcept;

}  // namespace tracking
