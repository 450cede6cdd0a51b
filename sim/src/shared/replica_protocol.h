#pragma once
#include <memory>
#include <optional>

#include "messages/world_messages.h"

namespace sim {

/// How one worker keeps its copy of the world in step with the others': one for each Pace. Knows no clock, no
/// sockets, no market. Bodies are own, foreign, or given (handed over, not yet registered elsewhere: nobody
/// steps them).
class ReplicaProtocol {
public:
    virtual ~ReplicaProtocol() = default;

    /// A state or update message of another worker, in the order in which that one sent them.
    virtual void take(const WorldHeader& header, StateMessage&& message) { (void)header, (void)message; }
    virtual void take(const WorldHeader& header, PackedUpdates&& message) { (void)header, (void)message; }
    virtual void take(SnapshotMessage&& message) {
        (void)message;
    }  ///< once, before the first step of one who joins late
    /// Who is there now. Workers that went own nothing from here on; whose their bodies are follows by
    /// Ownership.
    virtual void members(const std::vector<std::uint32_t>& workers) = 0;
    /// Registered owners. Becomes effective at the message's step: may make this worker repeat its last step
    /// (lockstep), or take bodies over that are some steps away (bounded).
    virtual void own(const Ownership& ownership) = 0;

    /// Whether the next step can be done now: what it needs is there and the bound allows it. False when
    /// done() or nothing is own (lockstep: then too it follows what the others publish, see follow).
    [[nodiscard]] virtual bool ready() const = 0;
    virtual void step() = 0;  ///< requires ready()
    /// Message of the step just done: StateMessage or UpdateMessage, encoded. Called once after step().
    [[nodiscard]] virtual std::vector<std::uint8_t> publish(std::uint32_t epoch,
                                                            const StepReport& report) = 0;
    /// Without own bodies: goes along as far as the others' messages allow.
    virtual void follow() = 0;

    /// Own bodies that move, for the market; those that must stay together (joined by constraints, in bounded
    /// pace) as one lot.
    struct Lot {
        std::vector<std::uint32_t> bodies;
        double cost_s;  ///< smoothed seconds a step
        double pull;    ///< the larger, the nearer to the bodies of the worker asked about than to own ones
    };
    [[nodiscard]] virtual std::vector<Lot> lots(std::uint32_t towards) const = 0;
    /// Stops owning: their exact records at the end of this worker's last step. The caller sends the
    /// Handover.
    [[nodiscard]] virtual Handover give(const std::vector<std::uint32_t>& bodies) = 0;
    /// What the last step cost, to be shared out to the own bodies by World::work.
    virtual void cost(double seconds) = 0;

    [[nodiscard]] virtual std::uint64_t steps_done() const = 0;
    [[nodiscard]] virtual bool at_end() const = 0;  ///< settings.steps reached
    /// Nothing more to do. In bounded pace one more publication follows the last step, when all the others
    /// have done theirs: with the pushes that came late put right.
    [[nodiscard]] virtual bool done() const = 0;
    [[nodiscard]] virtual int own_bodies() const = 0;
    [[nodiscard]] virtual int lead() const = 0;       ///< over the slowest that owns a body, now
    [[nodiscard]] virtual int ghost_age() const = 0;  ///< of the oldest used in the last step
    [[nodiscard]] virtual const World& world() const = 0;
};

[[nodiscard]] std::unique_ptr<ReplicaProtocol> make_lockstep_exchange(const SceneMessage& scene);
[[nodiscard]] std::unique_ptr<ReplicaProtocol> make_bounded_exchange(const SceneMessage& scene);

}  // namespace sim
