#pragma once
#include <span>
#include <vector>

#include "world/shared_world.h"

namespace sim {

/// Smoothed work of each body (World::work), its share of what a step takes.
class BodyCosts {
public:
    static constexpr double kSmoothing = 5;  ///< time constant [steps]
    explicit BodyCosts(int bodies) : cost_(static_cast<std::size_t>(bodies), -1.0) {}
    /// After a step, of the bodies that took part in it.
    void add(const SharedWorld& world, std::span<const int> bodies);
    /// Forgets a body's cost; its smoothing starts anew.
    void forget(int body) { cost_[static_cast<std::size_t>(body)] = -1; }
    /// Negative: unknown.
    [[nodiscard]] double of(int body) const { return cost_[static_cast<std::size_t>(body)]; }

private:
    std::vector<double> cost_;
};

}  // namespace sim
