#include "shared/neighbour_check.h"

#include <algorithm>
#include <functional>

#include "shared/foreign_bodies.h"

namespace sim {

NeighbourCheck::NeighbourCheck(const World& all, std::size_t constraints, std::uint64_t steps)
    : constraints_(constraints), steps_(steps) {
    for (int i = 0; i < all.bodies(); ++i)
        modes_.push_back(all.definition(i).moves() ? all.state(i).q.size() : -1);
}

void NeighbourCheck::check(const std::vector<CrossImpulse>& crossed) const {
    for (const CrossImpulse& c : crossed)
        if (!moves(static_cast<std::uint32_t>(c.own)) || !moves(static_cast<std::uint32_t>(c.ghost)))
            throw DecodeError("found an impulse between bodies that are none");
    if (std::ranges::adjacent_find(crossed, std::ranges::greater_equal{}, bodies_of) != crossed.end())
        throw DecodeError("found impulses that are not in order");
}

void NeighbourCheck::check(const MessageHeader& header, const NeighbourMessage& message) const {
    if (header.step > steps_)
        throw DecodeError("found step " + std::to_string(header.step) + ", expected one up to " +
                          std::to_string(steps_));
    const auto& places = message.bodies.places();
    for (const PackedUpdates::Place& place : places)
        if (!moves(place.body) || place.modes != modes_[place.body])
            throw DecodeError("found the state of a body that is none, or has other modes");
    if (std::ranges::adjacent_find(places, std::ranges::greater_equal{}, &PackedUpdates::Place::body) !=
        places.end())
        throw DecodeError("found bodies that are not in order");
    for (const NeighbourMessage::Place& place : message.places)
        if (!moves(place.body)) throw DecodeError("found the place of a body that is none");
    check(message.crossed);
    for (const std::uint32_t constraint : message.broken)
        if (constraint >= constraints_)
            throw DecodeError("found constraint " + std::to_string(constraint) + ", expected one of " +
                              std::to_string(constraints_));
}

void NeighbourCheck::check(const MessageHeader& header, const FoundMessage& message) const {
    for (const FoundStep& found : message.steps) {
        if (found.step > std::min(header.step, steps_)) throw DecodeError("found a step that is to come");
        check(found.crossed);
    }
}

}  // namespace sim
