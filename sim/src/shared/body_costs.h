#pragma once
#include <span>
#include <vector>

#include "shared/replica_protocol.h"

namespace sim {

/// Smoothed cost of each body [s per step], for load balancing.
class BodyCosts {
public:
    /// `smoothing_steps`: time constant.
    BodyCosts(int bodies, double smoothing_steps);
    /// Distributes a step's seconds to the bodies by World::work.
    void share(double seconds, const World& world, std::span<const int> bodies);
    /// Forgets a body's cost; its smoothing starts anew.
    void forget(int body);
    [[nodiscard]] double of(int body) const { return cost_[static_cast<std::size_t>(body)]; }

private:
    double weight_;
    std::vector<double> cost_;  // negative: unknown
};

/// For each own body, how much nearer it is to the centre of `others` than to that of `own` [m]. Without
/// others: its coordinate along the longest extent of `own`, so that bodies that are sold lie together.
[[nodiscard]] std::vector<double> pulls(const World& world, std::span<const int> own,
                                        std::span<const int> others);

}  // namespace sim
