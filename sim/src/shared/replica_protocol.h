#pragma once
#include <functional>
#include <memory>

#include "messages/worker_messages.h"
#include "shared/columns.h"

namespace sim {

/// How a step that several do together hears what others tell.
struct StepChannel {
    /// Has what was sent go out; wait: and returns once something has come and was taken. Empty: this worker cannot wait within a
    /// step, so it does each alone.
    std::function<void(bool wait)> flush;
};

/// How one worker keeps its copy of the world consistent with the others': one implementation per Pace. Uses
/// no clock, no sockets and no load balancing. A body is own, foreign, or given (handed over, but not yet
/// registered elsewhere: no worker steps it).
class ReplicaProtocol {
public:
    virtual ~ReplicaProtocol() = default;

    /// An encoded message to other workers, by way of the application or not; to none: to the application.
    using Send = std::function<void(std::vector<std::uint32_t>&& to, std::vector<std::uint8_t>&&,
                                    bool by_application)>;
    /// How messages leave, to be set before anything else.
    void send_by(Send send) { send_ = std::move(send); }
    /// What another worker reports of a step, as its turn comes: its header, the seconds of a step, the number of its bodies.
    using Report = std::function<void(const MessageHeader&, double smoothed_s, std::uint32_t own)>;
    void report_to(Report report) { report_ = std::move(report); }

    /// What another worker says of its steps, in the order in which it was sent (lockstep).
    virtual void take(const MessageHeader& header, StateMessage&& message) { (void)header, (void)message; }
    virtual void take(const MessageHeader& header, PublishedMessage&& message) {
        (void)header, (void)message;
    }
    /// These come in any order, and over again. They throw PeerError, and nothing has happened, where a worker says what cannot be.
    virtual void take(const MessageHeader& header, NeighbourMessage&& message) {
        (void)header, (void)message;
    }
    virtual void take(const MessageHeader& header, FoundMessage&& message) { (void)header, (void)message; }
    virtual void take(const MessageHeader& header, const HeardMessage& message) {
        (void)header, (void)message;
    }
    /// What another worker tells of a step that it does together with this one. May come within step().
    virtual void take(const MessageHeader& header, PartMessage&& message) { (void)header, (void)message; }
    virtual void members_within(const std::vector<std::uint32_t>& workers) {
        (void)workers;
    }  ///< come within step()
    virtual void take(SnapshotMessage&& message) {
        (void)message;
    }  ///< once, before the first step of one who joins late
    /// The members now, and the epoch in which the application says so. Workers that left own nothing from here on;
    /// Ownership messages say who owns their bodies.
    virtual void members(const Members& message, std::uint32_t epoch) = 0;
    /// Registered owners, in this epoch. Becomes effective at the message's step: this worker may have to publish its last step once
    /// more (lockstep, owes()), or take bodies over that are some steps away (bounded).
    virtual void own(const Ownership& ownership, std::uint32_t epoch) = 0;
    /// Bodies came to this worker after its last step, which nobody has published of them.
    [[nodiscard]] virtual bool owes() const = 0;

    /// Whether the next step can be done now: its inputs have arrived and the bound allows it. False if
    /// done(), or if no body is own (lockstep then follows what the others publish, see follow, where it can).
    [[nodiscard]] virtual bool ready() const = 0;
    /// Requires ready(). In lockstep with others, by the channel, if that can wait.
    virtual void step(const StepChannel& channel) = 0;
    /// Sends the messages of the step just done. Called once after step(), and where it owes().
    virtual void publish(std::uint32_t epoch, const StepReport& report) = 0;
    /// Without own bodies: advances as far as the others' messages allow.
    virtual void follow() = 0;

    /// Who has what where, for load balancing.
    [[nodiscard]] virtual Holdings holdings() = 0;
    /// Bounded: whether what is own may be given: all is known that others found at it up to this step.
    [[nodiscard]] virtual bool may_give() const { return true; }
    /// Bounded: whether the others have heard all that was told, as far as they say; asks those once that have not.
    [[nodiscard]] virtual bool all_have_heard() { return true; }
    /// Bounded: asks the others for what this worker has not heard, and how far they have heard it.
    virtual void ask_again() {}
    /// Bounded: that another worker has done, as far as is known.
    [[nodiscard]] virtual std::uint64_t steps_of(std::uint32_t worker) const {
        (void)worker;
        return 0;
    }
    /// Stops owning: their exact records at the end of this worker's last step. The caller sends the
    /// Handover.
    [[nodiscard]] virtual Handover give(const std::vector<std::uint32_t>& bodies) = 0;
    /// After a step: notes what each own body costs, for load balancing.
    virtual void weigh() = 0;

    [[nodiscard]] virtual std::uint64_t steps_done() const = 0;  ///< by this worker
    [[nodiscard]] virtual bool at_end() const = 0;               ///< settings.steps reached
    /// Nothing is left to do. In bounded pace one more publication follows the last step, once all others
    /// have done theirs: corrected by the impulses that arrived late.
    [[nodiscard]] virtual bool done() const = 0;
    [[nodiscard]] virtual int own_bodies() const = 0;
    /// No body is own, or will be in some steps.
    [[nodiscard]] virtual bool has_nothing() const { return own_bodies() == 0; }
    [[nodiscard]] virtual int lead() const = 0;       ///< steps ahead of the slowest owner, now
    [[nodiscard]] virtual int ghost_age() const = 0;  ///< of the oldest used in the last step
    /// Lockstep: the last step was done alone, as something kept it from being done with the others.
    [[nodiscard]] virtual bool was_alone() const { return false; }
    [[nodiscard]] virtual const World& world() const = 0;
    virtual void use_threads(int threads) = 0;  ///< see World::use_threads

protected:
    Send send_;
    Report report_;
};

/// Another worker says what cannot be. The application has not seen it, or cannot know that.
struct PeerError : DecodeError {
    PeerError(std::uint32_t who, const std::string& what) : DecodeError(what), worker(who) {}
    std::uint32_t worker;
};

/// No worker tells another more parts of one step, in lockstep.
[[nodiscard]] std::size_t most_parts(const WorldScene& scene);

[[nodiscard]] std::unique_ptr<ReplicaProtocol> make_lockstep_exchange(const SceneMessage& scene);
[[nodiscard]] std::unique_ptr<ReplicaProtocol> make_bounded_exchange(const SceneMessage& scene);

}  // namespace sim
