#pragma once
#include "shared/market.h"
#include "shared/replica_protocol.h"

namespace sim {

/// One worker, without clock or transport: the same code runs behind ZeroMQ and on simulated processors.
///
///   take() ... whenever a message comes, but not between step() and worked()
///   if (ready()) { step(); worked(seconds, waited); }
///   outgoing() after each of these
class SharedWorldWorker {
public:
    explicit SharedWorldWorker(const SceneMessage& scene);  ///< from the first message

    /// Handles a message relayed by the application, decoded. Throws DecodeError if it is inconsistent.
    void take(const WorldHeader& header, WorldMessage&& message);
    [[nodiscard]] bool ready() const;
    void step();
    /// After step(): the seconds it took, and those the worker had waited before it. Queues the message to
    /// publish, then balances the load.
    void worked(double seconds, double waited_s);
    /// Encoded messages to the application, in order; empties the queue.
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing();
    /// Hands all bodies over, after the step if one is under way; then left() becomes true.
    void drain();
    [[nodiscard]] bool left() const noexcept { return left_; }
    [[nodiscard]] bool ended() const noexcept { return ended_; }  ///< EndOfRun or Refusal came
    [[nodiscard]] double slowing() const;  ///< factor of the scene's events for this worker's next step
    [[nodiscard]] std::uint64_t steps_done() const { return exchange_->steps_done(); }  ///< by this worker
    /// Why ready() is false, in words.
    [[nodiscard]] std::string waits_for() const;
    [[nodiscard]] double work() const;  ///< work of the last step, in units of World::work

private:
    void take_message(const WorldHeader& header, Members&& message);
    void take_message(const WorldHeader& header, Ownership&& message);
    void take_message(const WorldHeader& header, SnapshotMessage&& message);
    void take_message(const WorldHeader& header, StateMessage&& message);
    void take_message(const WorldHeader& header, PackedUpdates&& message);
    void take_message(const WorldHeader& header, Offer&& message);
    void take_message(const WorldHeader& header, OfferAnswer&& message);
    void take_message(const WorldHeader& header, EndOfRun&& message);
    void take_message(const WorldHeader& header, Refusal&& message);
    void take_message(const WorldHeader& header, WorldBeat&& message);
    template <typename Other>
    void take_message(const WorldHeader& header, Other&& message);

    void send(const WorldMessage& message);
    void publish(double seconds, double waited_s);
    void trade();
    void hand_over();
    void leave();

    std::uint32_t self_;
    std::vector<WorldEvent> events_;  // those that slow a worker
    std::unique_ptr<ReplicaProtocol> exchange_;
    Market market_;
    bool bounded_;
    std::vector<std::vector<std::uint8_t>> queue_;
    std::uint32_t epoch_ = 0;
    std::uint64_t published_ = 0;  // step
    int lead_ = 0;                 // at the start of the step
    // Bounded pace: sold bodies change owners at a step that neither side has passed, so no body skips a
    // step. The buyer waits there; the seller goes on to it.
    std::uint64_t handover_step_ = 0;
    std::vector<std::uint32_t> sellers_;  // whose offers were accepted, and whose bodies have not come
    bool stepping_ = false, draining_ = false, left_ = false, ended_ = false;
};

}  // namespace sim
