#pragma once
#include <span>
#include <vector>

#include "shared/replica_protocol.h"

namespace sim {

/// What each body costs its worker [s a step], smoothed; and which of a worker's bodies go first.
class BodyCosts {
public:
    /// `smoothing_steps`: time constant.
    BodyCosts(int bodies, double smoothing_steps);
    /// Shares a step's seconds out to the bodies by World::work.
    void share(double seconds, const World& world, std::span<const int> bodies);
    /// That of a body which was not known here starts anew.
    void forget(int body);
    [[nodiscard]] double of(int body) const { return cost_[static_cast<std::size_t>(body)]; }

private:
    double weight_;
    std::vector<double> cost_;  // negative: unknown
};

/// How much nearer a place is to the centre of `others` than to that of `own` [m]. Without others: how far it
/// is out along the longest extent of `own`, so that what goes lies together.
[[nodiscard]] std::vector<double> pulls(const World& world, std::span<const int> own,
                                        std::span<const int> others);

}  // namespace sim
