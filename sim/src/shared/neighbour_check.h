#pragma once
#include <cstdint>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// The application's check of messages between workers before it relays them. It needs only the scene.
class NeighbourCheck {
public:
    /// `all`: the world with the bodies that are added later, see with_later.
    NeighbourCheck(const World& all, std::size_t constraints, std::uint64_t steps);

    /// Throw DecodeError for a body or constraint that does not exist, a wrong number of modes, an impossible
    /// step, or a list that is not in order.
    void check(const MessageHeader& header, const NeighbourMessage& message) const;
    void check(const MessageHeader& header, const FoundMessage& message) const;

private:
    void check(const std::vector<CrossImpulse>& crossed) const;
    [[nodiscard]] bool moves(std::uint32_t body) const { return body < modes_.size() && modes_[body] >= 0; }

    std::vector<Eigen::Index> modes_;  // of each body; -1: it does not move
    std::size_t constraints_;
    std::uint64_t steps_;
};

}  // namespace sim
