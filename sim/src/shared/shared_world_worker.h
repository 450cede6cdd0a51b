#pragma once
#include <deque>
#include <utility>

#include "shared/bounded_exchange.h"
#include "shared/market.h"

namespace sim {

/// One worker, without clock or transport: the same code runs behind ZeroMQ and on simulated processors.
///
///   take() ... whenever a message comes, but not between step() and worked()
///   if (ready()) { step(); worked(times); }
///   outgoing() after each of these
class SharedWorldWorker {
public:
    explicit SharedWorldWorker(const SceneMessage& scene);  ///< from the first message
    SharedWorldWorker(const SharedWorldWorker&) = delete;
    SharedWorldWorker& operator=(const SharedWorldWorker&) = delete;

    /// Handles a message of the application or of another worker, decoded. Throws DecodeError if it is inconsistent.
    void take(const MessageHeader& header, WorkerMessage&& message);
    [[nodiscard]] bool ready() const;
    void step();
    void use_threads(int threads) { exchange_.use_threads(threads); }  ///< see World::use_threads
    /// Whether only another worker's answer to an offer keeps this one from going on; and then it can go on without.
    [[nodiscard]] bool awaits_answer() const { return market_.awaits_answer(); }
    void stop_waiting_for_answer();
    struct Times {  ///< of a step, see WorkerStep
        double seconds = 0, waited_s = 0, processor_s = 0;
    };
    /// After step(). Queues the message to publish, then balances the load.
    void worked(const Times& times);
    /// Encoded messages to the application, in order; empties the queue.
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing() { return std::exchange(queue_, {}); }
    /// Gives all bodies to others, then left() becomes true. It goes on until they are sold: a body changes owners at a step
    /// that neither side has passed. Not between step() and worked().
    void drain();
    [[nodiscard]] bool left() const noexcept { return left_; }
    [[nodiscard]] bool ended() const noexcept { return ended_; }  ///< EndOfRun or Refusal came
    [[nodiscard]] double slowing() const;  ///< factor of the scene's events for this worker's next step
    [[nodiscard]] std::uint64_t steps_done() const { return exchange_.steps_done(); }  ///< by this worker
    /// Why ready() is false, in words.
    [[nodiscard]] std::string waits_for() const;
    [[nodiscard]] double work() const;  ///< work of the last step, in units of World::work

private:
    void take_message(const MessageHeader& header, Members&& message);
    void take_message(const MessageHeader& header, Ownership&& message);
    void take_message(const MessageHeader& header, PastMessage&& message);
    void take_message(const MessageHeader& header, NeighbourMessage&& message);
    void take_message(const MessageHeader& header, FoundMessage&& message);
    void take_message(const MessageHeader& header, Offer&& message);
    void take_message(const MessageHeader& header, OfferAnswer&& message);
    void take_message(const MessageHeader& header, Gather&& message);
    void take_message(const MessageHeader& header, EndOfRun&& message);
    void take_message(const MessageHeader& header, Refusal&& message);
    void take_message(const MessageHeader& header, Beat&& message);
    template <typename Other>
    void take_message(const MessageHeader& header, Other&& message);

    void send(const WorkerMessage& message);
    void publish(const Times& times);
    void trade();
    [[nodiscard]] bool may_leave() const;
    [[nodiscard]] bool hands_over() const;
    [[nodiscard]] std::uint64_t last_before(
        const std::pair<const std::uint32_t, std::uint64_t>& seller) const;
    [[nodiscard]] std::optional<Offer> make_offer();
    [[nodiscard]] bool hand_over();
    void leave();

    std::uint32_t self_;
    std::vector<WorldEvent> events_;  // those that slow a worker
    BoundedExchange exchange_;
    Market market_;
    std::uint64_t forgets_after_;  // what it was asked for [steps]
    std::vector<std::vector<std::uint8_t>> queue_;
    std::uint32_t epoch_ = 0;
    int lead_ = 0;  // at the start of the step
    // Sold bodies change owners at a step that neither side has passed, so no body skips a
    // step: the one after the buyer's. The buyer waits there; the seller goes on to it.
    std::uint64_t handover_step_ = 0;
    std::optional<std::uint64_t> offered_at_;  // step
    // Whose offers were accepted and whose bodies have not come; the step up to which this worker goes on, or up to where they are.
    std::map<std::uint32_t, std::uint64_t> sellers_;
    struct Asked {
        std::uint64_t step;  // of the application's view
        Gather what;
    };
    std::deque<Asked> gathers_;  // to be offered
    bool draining_ = false, gives_up_ = false, left_ = false, ended_ = false;
};

}  // namespace sim
