#include "shared/neighbour_streams.h"

#include <utility>

namespace sim {
namespace {

std::uint32_t number_of(const NeighbourStreams::Message& message) {
    return std::visit([](const auto& m) { return m.number; }, message);
}

// In memory, about.
std::size_t bytes_of(const NeighbourStreams::Message& message) {
    if (const auto* found = std::get_if<FoundMessage>(&message)) {
        std::size_t bytes = sizeof(FoundMessage);
        for (const FoundStep& step : found->steps)
            bytes += sizeof(FoundStep) + step.crossed.size() * sizeof(CrossImpulse);
        return bytes;
    }
    const auto& told = std::get<NeighbourMessage>(message);
    return sizeof told + told.bodies.bytes().size() +
           told.bodies.places().size() * sizeof(PackedUpdates::Place) +
           told.crossed.size() * sizeof(CrossImpulse) + told.broken.size() * sizeof(std::uint32_t) +
           told.places.size() * sizeof(NeighbourMessage::Place);
}

}  // namespace

// A worker whose step another one waits for is at most bound + 1 steps ahead of that, and tells one message a step, and one for each
// change of owners. Of one body there is a state, and impulses at some dozen contacts, of 100 bytes each.
NeighbourStreams::NeighbourStreams(std::size_t bodies, int bound)
    : most_messages_(64 + 4 * static_cast<std::size_t>(bound + 2)),
      most_bytes_((1 << 20) + 2000 * bodies * static_cast<std::size_t>(bound + 2)) {}

void NeighbourStreams::sent(std::uint32_t worker, std::vector<std::uint8_t> bytes) {
    Stream& stream = streams_.at(worker);
    ++stream.sent;
    stream.kept.push_back(std::move(bytes));
    if (stream.kept.size() > most_messages_) stream.kept.pop_front();  // to one that says nothing
}

void NeighbourStreams::heard_by(std::uint32_t worker, std::uint32_t number) {
    Stream& stream = streams_.at(worker);
    if (number <= stream.heard_there || number > stream.sent) return;
    stream.heard_there = number;
    while (stream.kept.size() > stream.sent - number) stream.kept.pop_front();
}

std::vector<std::vector<std::uint8_t>> NeighbourStreams::again(std::uint32_t worker) {
    Stream& stream = streams_.at(worker);
    const std::uint32_t first = std::max(stream.again, stream.heard_there);
    stream.again = stream.sent;
    const std::size_t count = std::min<std::size_t>(stream.sent - first, stream.kept.size());
    return {stream.kept.end() - static_cast<std::ptrdiff_t>(count), stream.kept.end()};
}

void NeighbourStreams::put(const MessageHeader& header, Message&& message) {
    Stream& stream = streams_.at(header.worker);
    const std::uint32_t number = number_of(message);
    if (number <= stream.taken || stream.waiting.contains(number)) {
        if (static_cast<std::size_t>(++stream.repeated) > 4 * most_messages_)
            throw DecodeError("found what it told before, more often than is asked for");
        return;
    }
    const std::size_t bytes = bytes_of(message);
    if (number > stream.taken + most_messages_ || stream.waiting_bytes + bytes > most_bytes_)
        throw DecodeError("found more that has to wait than anybody tells");
    stream.waiting_bytes += bytes;
    stream.waiting.emplace(number, Heard{header, std::move(message)});
}

std::optional<NeighbourStreams::Heard> NeighbourStreams::take(std::uint32_t worker, std::uint32_t epoch) {
    Stream& stream = streams_.at(worker);
    const auto next = stream.waiting.begin();
    if (next == stream.waiting.end() || next->first != stream.taken + 1 || next->second.header.epoch > epoch)
        return std::nullopt;
    std::optional<Heard> heard = std::move(next->second);
    stream.waiting.erase(next);
    stream.waiting_bytes -= bytes_of(heard->message);
    ++stream.taken, stream.repeated = 0;
    return heard;
}

std::uint32_t NeighbourStreams::tell_heard(std::uint32_t worker) {
    Stream& stream = streams_.at(worker);
    return stream.told = stream.taken;
}

}  // namespace sim
