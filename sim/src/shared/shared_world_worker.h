#pragma once
#include <deque>
#include <utility>

#include "shared/bounded_exchange.h"
#include "shared/market.h"

namespace sim {

/// One worker, without clock or transport: the same code runs behind ZeroMQ and on simulated processors.
///
///   receive() ... whenever a message comes, but not between step() and end_step()
///   if (ready()) { step(); end_step(times); }
///   outgoing() after each of these
class SharedWorldWorker {
public:
    explicit SharedWorldWorker(const SceneMessage& scene);  ///< from the first message
    SharedWorldWorker(const SharedWorldWorker&) = delete;
    SharedWorldWorker& operator=(const SharedWorldWorker&) = delete;

    /// Handles a decoded message of the application or of another worker. Throws DecodeError if it is
    /// inconsistent.
    void receive(const MessageHeader& header, WorkerMessage&& message);
    [[nodiscard]] bool ready() const;
    void step();
    void use_threads(int threads) { exchange_.use_threads(threads); }  ///< see World::use_threads
    /// Whether only the answer to an offer keeps this worker from its next step. It can do the step without
    /// the answer, see stop_waiting_for_answer.
    [[nodiscard]] bool awaits_answer() const { return market_.awaits_answer(); }
    void stop_waiting_for_answer();
    struct Times {  ///< of a step, see WorkerStep
        double seconds = 0, waited_s = 0, processor_s = 0;
    };
    /// After step(): queues the step's messages, then balances the load.
    void end_step(const Times& times);
    /// Encoded messages to the application, in order; empties the queue.
    [[nodiscard]] std::vector<std::vector<std::uint8_t>> outgoing() { return std::exchange(queue_, {}); }
    /// Begins to leave: sells all bodies to others, then left() becomes true. Meanwhile the worker goes on,
    /// since bodies change owners at a step that neither side has passed. Not between step() and end_step().
    void drain();
    [[nodiscard]] bool left() const noexcept { return left_; }
    [[nodiscard]] bool ended() const noexcept { return ended_; }  ///< EndOfRun or Refusal came
    [[nodiscard]] double slowing() const;  ///< factor of the scene's events for this worker's next step
    [[nodiscard]] std::uint64_t steps_done() const { return exchange_.steps_done(); }  ///< by this worker
    [[nodiscard]] std::string waits_for() const;  ///< why ready() is false, in words
    [[nodiscard]] double work() const;            ///< work of the last step, in units of World::work

private:
    void handle(const MessageHeader& header, Members&& message);
    void handle(const MessageHeader& header, Ownership&& message);
    void handle(const MessageHeader& header, Offer&& message);
    void handle(const MessageHeader& header, OfferAnswer&& message);
    void handle(const MessageHeader& header, Gather&& message);
    template <typename Other>
    void handle(const MessageHeader& header, Other&& message);

    /// A worker whose offer was accepted, and the step of the sale: this worker does not pass it, nor the
    /// step at which the seller is, before the bodies come.
    using Sellers = std::map<std::uint32_t, std::uint64_t>;

    void send(const WorkerMessage& message);
    void publish(const Times& times);
    void trade();
    [[nodiscard]] bool may_leave() const;
    [[nodiscard]] bool is_at_handover() const;
    [[nodiscard]] bool is_at_purchase() const;
    [[nodiscard]] std::optional<Offer> make_offer();
    [[nodiscard]] bool hand_over();
    void leave();

    std::uint32_t self_;
    std::vector<WorldEvent> events_;  // those that slow a worker down
    BoundedExchange exchange_;
    Market market_;
    std::uint64_t requests_hold_;  // steps after which a request of the application is void
    std::vector<std::vector<std::uint8_t>> queue_;
    std::uint32_t epoch_ = 0;
    int lead_ = 0;  // at the start of the step
    // Sold bodies change owners at a step that neither side has passed, so that no body skips a
    // step: the one after the buyer's. The buyer waits there; the seller goes on to it.
    std::uint64_t handover_step_ = 0;
    std::optional<std::uint64_t> offered_at_;  // step
    Sellers sellers_;
    struct Request {
        std::uint64_t step;  // of the application's view
        Gather what;
    };
    std::deque<Request> requests_;  // of the application: bodies to be offered
    bool draining_ = false, gives_up_ = false, left_ = false, ended_ = false;
};

}  // namespace sim
