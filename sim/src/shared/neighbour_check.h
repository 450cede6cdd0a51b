#pragma once
#include <cstdint>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// By what the application checks messages of one worker to another before it passes them on: without what changes in the run.
class NeighbourCheck {
public:
    /// all: the world with the bodies that come later, see with_later.
    NeighbourCheck(const World& all, std::size_t constraints, std::uint64_t steps);

    /// Throw DecodeError: a body or constraint that is none, other modes than the body has, a step that cannot be, or what is not in
    /// order.
    void check(const MessageHeader& header, const NeighbourMessage& message) const;
    void check(const MessageHeader& header, const FoundMessage& message) const;

private:
    void check(const std::vector<CrossImpulse>& crossed) const;
    void check_constraints(const std::vector<std::uint32_t>& broken) const;
    [[nodiscard]] bool moves(std::uint32_t body) const { return body < modes_.size() && modes_[body] >= 0; }

    std::vector<Eigen::Index> modes_;  // of each body; -1: it does not move
    std::size_t constraints_;
    std::uint64_t steps_;
};

}  // namespace sim
