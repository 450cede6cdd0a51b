#pragma once
#include <deque>

#include "shared/market.h"
#include "shared/replica_protocol.h"

namespace sim {

/// How long a worker waits before it asks again, see SharedWorldWorker; then twice as long [s].
constexpr double kAskAgain = 1;

/// One worker, without clock or transport: the same code runs behind ZeroMQ and on simulated processors.
///
///   take() ... whenever a message comes, but between step() and worked() only in flush
///   if (ready()) { step(flush); worked(times); }
///   outgoing() after each of these, and in flush
class SharedWorldWorker {
public:
    explicit SharedWorldWorker(const SceneMessage& scene);  ///< from the first message
    SharedWorldWorker(const SharedWorldWorker&) = delete;
    SharedWorldWorker& operator=(const SharedWorldWorker&) = delete;

    /// Handles a message of the application or of another worker, decoded. Throws DecodeError if it is inconsistent; as PeerError, if it
    /// came from another worker, which the caller may then hear no more.
    void take(const MessageHeader& header, WorkerMessage&& message);
    [[nodiscard]] bool ready() const;
    /// flush(wait): called where the step tells others, and where it needs what they tell. Sends outgoing(); wait: and
    /// returns once something has come and was given to take(). Without it the step is done alone.
    void step(const std::function<void(bool wait)>& flush = {});
    void use_threads(int threads) { exchange_->use_threads(threads); }  ///< see World::use_threads
    void stop_waiting() { exchange_->members_within({}); }  ///< within flush: the step is done alone
    /// Whether only an answer of another worker keeps this one from going on, to an offer, or, before it leaves, that it has heard all;
    /// and then it can go on without.
    [[nodiscard]] bool awaits_answer() const { return market_.awaits_answer() || asks_if_heard_; }
    void stop_waiting_for_answer();
    /// Where it has been waiting for kAskAgain: something may have been lost on its way.
    void ask_again() { exchange_->ask_again(); }
    struct Times {  ///< of a step, see WorkerStep
        double seconds = 0, waited_s = 0, processor_s = 0;
        std::uint64_t linked = 0;  ///< bytes that were sent to other workers directly, since the step before
    };
    /// After step(). Queues the message to publish, then balances the load.
    void worked(const Times& times);
    struct Outgoing {
        std::vector<std::uint32_t> to;  ///< workers; empty: to the application
        std::vector<std::uint8_t> bytes;
        bool by_application = true;  ///< also to workers that can be reached, see relayed
    };
    /// Encoded messages, in order; empties the queue.
    [[nodiscard]] std::vector<Outgoing> outgoing();
    /// Of a message to others: what the application is asked to pass on to those that cannot be reached.
    [[nodiscard]] std::vector<std::uint8_t> relayed(std::vector<std::uint32_t> to,
                                                    std::vector<std::uint8_t> bytes) const {
        return encode({self_, epoch_, exchange_->steps_done()},
                      RelayMessage{std::move(to), std::move(bytes)});
    }
    /// Gives all bodies to others, then left() becomes true. In lockstep at once, or after the step if one is under way. In bounded pace
    /// it goes on until they are sold: a body changes owners at a step that neither side has passed.
    void drain();
    [[nodiscard]] bool left() const noexcept { return left_; }
    [[nodiscard]] bool ended() const noexcept { return ended_; }  ///< EndOfRun or Refusal came
    [[nodiscard]] double slowing() const;  ///< factor of the scene's events for this worker's next step
    [[nodiscard]] std::uint64_t steps_done() const { return exchange_->steps_done(); }  ///< by this worker
    /// Why ready() is false, in words.
    [[nodiscard]] std::string waits_for() const;
    [[nodiscard]] bool was_alone() const { return exchange_->was_alone(); }  ///< see ReplicaProtocol
    [[nodiscard]] double work() const;  ///< work of the last step, in units of World::work

private:
    void take_message(const MessageHeader& header, Members&& message);
    void take_message(const MessageHeader& header, Ownership&& message);
    void take_message(const MessageHeader& header, SnapshotMessage&& message);
    void take_message(const MessageHeader& header, StateMessage&& message);
    void take_message(const MessageHeader& header, PublishedMessage&& message);
    void take_message(const MessageHeader& header, PartMessage&& message);
    void take_within(const MessageHeader& header, WorkerMessage&& message);
    void take_message(const MessageHeader& header, NeighbourMessage&& message);
    void take_message(const MessageHeader& header, FoundMessage&& message);
    void take_message(const MessageHeader& header, HeardMessage&& message);
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
    [[nodiscard]] bool may_leave();
    [[nodiscard]] bool hands_over() const;
    [[nodiscard]] std::uint64_t last_before(
        const std::pair<const std::uint32_t, std::uint64_t>& seller) const;
    [[nodiscard]] std::optional<Offer> make_offer();
    [[nodiscard]] bool hand_over();
    void leave();

    std::uint32_t self_;
    std::vector<WorldEvent> events_;  // those that slow a worker
    std::unique_ptr<ReplicaProtocol> exchange_;
    Market market_;
    bool bounded_;
    std::uint64_t forgets_after_;  // what it was asked for [steps]
    std::vector<Outgoing> queue_;
    std::uint32_t epoch_ = 0;
    int lead_ = 0;  // at the start of the step
    // Bounded pace: sold bodies change owners at a step that neither side has passed, so no body skips a
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
    struct Deferred {
        MessageHeader header;
        WorkerMessage message;
    };
    std::vector<Deferred> deferred_;  // came within a step
    bool within_ = false, stepping_ = false, draining_ = false, gives_up_ = false, left_ = false,
         ended_ = false;
    bool asks_if_heard_ = false,
         stops_asking_ = false;  // before it leaves, whether the others have heard all
};

}  // namespace sim
