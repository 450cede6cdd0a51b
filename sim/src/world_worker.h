#pragma once
#include "exchange.h"
#include "market.h"

namespace sim {

/// One worker without clock and sockets: the same code runs behind ZeroMQ and on simulated processors.
class WorldWorker {
public:
    explicit WorldWorker(const SceneMessage& scene);

    /// A message passed on by the application, decoded. Throws DecodeError if it can only be a mistake.
    void take(const WorldHeader& header, WorldMessage&& message);
    [[nodiscard]] bool ready() const;
    void step();
    /// After step(): what it cost and how long the worker had waited before it. Queues what it publishes,
    /// then trades.
    void worked(double seconds, double waited_s);
    /// Encoded messages to the application, in order; empties the queue.
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing();
    /// Gives everything away; then left() becomes true.
    void drain();
    [[nodiscard]] bool left() const;
    [[nodiscard]] bool ended() const;      ///< EndOfRun or Refusal came
    [[nodiscard]] double slowing() const;  ///< factor of the scene's events for this worker's next step
    [[nodiscard]] std::uint64_t steps_done() const;
};

}  // namespace sim
