#pragma once
#include <deque>
#include <map>
#include <optional>
#include <variant>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// What one worker tells each other one in bounded pace, and hears from it: messages with numbers from 1. They are heard each once and in
/// order, whichever way they come: on a link or by way of the application, one before another, or once more. What the other one
/// has not said that it has heard is kept here, to be told again.
class NeighbourStreams {
public:
    using Message = std::variant<NeighbourMessage, FoundMessage>;
    struct Heard {
        MessageHeader header;
        Message message;
    };
    /// bodies: number, with later ones.
    NeighbourStreams(std::size_t bodies, int bound);

    // The other workers.
    void add(std::uint32_t worker) { (void)streams_[worker]; }
    void remove(std::uint32_t worker) { streams_.erase(worker); }

    [[nodiscard]] std::uint32_t next_number(std::uint32_t worker) const {
        return streams_.at(worker).sent + 1;
    }
    void sent(std::uint32_t worker, std::vector<std::uint8_t> bytes);  ///< the next message, encoded
    /// That one has heard all up to this number, it says; what was not sent does not count.
    void heard_by(std::uint32_t worker, std::uint32_t number);
    [[nodiscard]] bool all_heard_by(std::uint32_t worker) const {
        return streams_.at(worker).heard_there == streams_.at(worker).sent;
    }
    /// It has heard so little of what was sent that more has to wait.
    [[nodiscard]] bool is_full(std::uint32_t worker) const {
        const Stream& stream = streams_.at(worker);
        return 2 * (stream.sent - stream.heard_there) > most_messages_;
    }
    /// That one asks for what it has not heard: what was sent since it asked before, or since it heard more.
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> again(std::uint32_t worker);

    /// Keeps a message until its turn. Throws DecodeError where nobody would send so much that has to wait.
    void put(const MessageHeader& header, Message&& message);
    /// The next one of this worker, once it is there and knows of no later owners than this epoch.
    [[nodiscard]] std::optional<Heard> take(std::uint32_t worker, std::uint32_t epoch);
    /// Number of the last that was taken; it counts as told to that worker, see untold.
    [[nodiscard]] std::uint32_t tell_heard(std::uint32_t worker);
    /// How many were taken of which it was not told.
    [[nodiscard]] std::uint32_t untold(std::uint32_t worker) const {
        return streams_.at(worker).taken - streams_.at(worker).told;
    }

private:
    struct Stream {
        std::uint32_t sent = 0, heard_there = 0, again = 0;
        std::deque<std::vector<std::uint8_t>> kept;  // those up to `sent`
        std::uint32_t taken = 0, told = 0;
        std::map<std::uint32_t, Heard> waiting;  // by number
        std::size_t waiting_bytes = 0;
        int repeated = 0;  // in a row
    };

    std::size_t most_messages_, most_bytes_;
    std::map<std::uint32_t, Stream> streams_;
};

}  // namespace sim
