#pragma once
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "run/scene_clock.h"
#include "shared/border_selection.h"
#include "shared/columns.h"
#include "shared/shared_contacts.h"
#include "shared/structures.h"
#include "world/shared_world.h"

namespace sim {

/// Keeps one worker's copy of the world consistent with the others'. It uses no clock, no sockets and no load
/// balancing.
///
/// Every worker is at a step of its own. Its world steps its own bodies. Those of the others' bodies that may
/// come near are placed as ghosts for each step, and move with them.
///
/// After a step the worker sends border data to every other worker: the states of own bodies that may come
/// near that worker's bodies, and the impulses at contacts between the two (NeighbourMessage). The
/// application gets the states of all own bodies. A body whose state is not sent is far away. The state of a
/// sleeping body is sent once, and again when it wakes.
///
/// A body changes owners at a step up to which the seller has received what all others found at it
/// (may_hand_over). So the seller has compared everything up to this step, and the buyer compares what comes
/// after. A worker that does not know of a sale yet sends to the seller what it finds at these bodies; as
/// soon as it knows, it sends that to the buyer, too (FoundMessage). Until all workers have done so, the
/// buyer compares nothing at these bodies. The application relays all messages in one order. So when a worker
/// receives a message whose sender knows of a sale, it knows of the sale, too, and has the seller's messages
/// up to it.
///
/// A contact between bodies of two owners is resolved by both (SharedContacts). Workers whose bodies touch
/// stay closer together than the bound demands (touching_lead).
class BoundedExchange {
public:
    explicit BoundedExchange(const SceneMessage& scene);

    /// Sends an encoded message to the application. To be set before anything else.
    using Send = std::function<void(std::vector<std::uint8_t>&&)>;
    void send_by(Send send) { send_ = std::move(send); }
    /// Takes what another worker reports of a step: its header, the seconds of a step, the number of its
    /// bodies.
    using Report = std::function<void(const MessageHeader&, double smoothed_s, std::uint32_t own)>;
    void report_to(Report report) { report_ = std::move(report); }

    /// Messages of other workers. The application has checked them (NeighbourCheck).
    void receive(const MessageHeader& header, NeighbourMessage&& message);
    void receive(const MessageHeader& header, FoundMessage&& message);
    /// For a worker that joins late: once, before its first step.
    void receive(const MessageHeader& header, const PastMessage& message);
    /// The members from this epoch on. Workers that left own nothing any more; Ownership messages name new
    /// owners.
    void set_members(const Members& message, std::uint32_t epoch);
    /// A registered owner, from this epoch on. It takes effect at the message's step, which may be some steps
    /// ahead.
    void set_owner(const Ownership& ownership, std::uint32_t epoch);
    /// Whether the present step has to be published although no step() led to it: this worker came to the
    /// last step by taking over bodies, or owns bodies only from a later step on and advanced to it.
    [[nodiscard]] bool must_publish() const {
        return published_ < step_ && (owned_.empty() ? owners_.contains(self_) : at_end());
    }

    /// Whether the next step can be done now: this worker owns bodies, its inputs have come and the bound
    /// allows it.
    [[nodiscard]] bool ready() const;
    void step();  ///< requires ready()
    /// Sends the messages of the step just done: once after step(), and where must_publish().
    void publish(std::uint32_t epoch, const StepReport& report);
    /// Without own bodies: advances as far as the others' messages allow.
    void advance_without_bodies();

    [[nodiscard]] Holdings holdings();  ///< who owns how much where, for load balancing
    /// Whether own bodies may be handed over: all that others found at them up to this step is known and
    /// compared.
    [[nodiscard]] bool may_hand_over() const;
    /// Steps that a worker has done, as far as is known.
    [[nodiscard]] std::uint64_t steps_of(std::uint32_t worker) const { return peer(worker).steps; }
    /// Gives up own bodies. Their records are exact, at the end of this worker's last step. The caller sends
    /// the Handover.
    [[nodiscard]] Handover hand_over(const std::vector<std::uint32_t>& bodies);
    void update_costs() { costs_.add(world_, owned_); }  ///< after a step: of own bodies, for load balancing

    [[nodiscard]] std::uint64_t steps_done() const { return step_; }  ///< by this worker
    [[nodiscard]] bool at_end() const { return step_ >= settings_.steps; }
    /// Nothing is left to do. Once all others have done the last step, it is published again: corrected by
    /// the impulses that came late.
    [[nodiscard]] bool done() const { return at_end() && settled_; }
    [[nodiscard]] int own_bodies() const { return static_cast<int>(owned_.size()); }
    /// This worker owns no body, now or from a later step on.
    [[nodiscard]] bool has_nothing() const { return owned_.empty() && future_.empty() && !owners_follow_; }
    [[nodiscard]] int lead() const;                             ///< steps ahead of the slowest owner, now
    [[nodiscard]] int ghost_age() const { return ghost_age_; }  ///< of the oldest used in the last step
    [[nodiscard]] const SharedWorld& world() const { return world_; }
    void use_threads(int threads) { world_.use_threads(threads); }  ///< see World::use_threads

private:
    /// How this worker's other bodies hold an own body that touches others' bodies.
    struct ContactHistory {
        StepImpulse mean;                 // of a step
        int steps = 0;                    // over which it is the mean
        std::uint64_t held = 0;           // last step with an impulse
        std::uint64_t cross_contact = 0;  // last step in which the body touched another worker's body
        bool watched = false;             // in the present step
    };
    /// What is known of another worker.
    struct Peer {
        std::uint64_t steps = 0;          // that it has done
        std::uint64_t message_step = 0;   // of its last message
        std::uint32_t message_epoch = 0;  // likewise
        std::uint64_t begun = 0;          // step at which it got bodies after it had owned nothing
    };
    /// Bodies that are registered for this worker from a later step on.
    struct FutureOwnership {
        Ownership ownership;
        std::uint32_t epoch;
    };
    /// Bodies that were bought. Not all others have sent yet what they found at them.
    struct Purchase {
        std::uint32_t epoch;
        std::set<std::uint32_t> waiting_for;  // workers
        std::vector<int> bodies = {};
        std::optional<std::uint64_t> step = {};  // from which they are own; none: they are still to come
        [[nodiscard]] bool is_complete() const { return step && waiting_for.empty(); }
    };
    struct Touch {
        std::uint64_t step = 0;  // in which bodies of the worker and own ones last touched
        int pairs = 0;           // of bodies, then
    };
    /// An own body after a step, in the order of BorderSelection.
    struct OwnBody {
        int body;
        std::int32_t update = -1,
                     packed = -1;  // places in the application's message and in packed_; -1: none
    };

    void apply_events(std::uint64_t step);
    void list_bodies();
    void set_own(int body, bool own);
    void take_over(const FutureOwnership& due);
    void take_over_due();
    void place_ghosts();
    void record_cross_impulses();
    void update_contact_histories();
    void publish_last(const StepReport& report) const;
    void collect_own();
    void send_borders(const StepReport& report);
    void send_border(std::uint32_t worker);
    void fill_update(int body, Update& update);
    void pack(OwnBody& own);
    [[nodiscard]] bool is_current(int body) const;
    void set_surroundings(const Ownership& ownership);
    void begin_purchase(std::vector<int>&& bodies, std::uint32_t epoch);
    void finish_purchases();
    void compare(std::uint32_t worker, std::uint64_t step) {
        if (step <= step_) contacts_.compare(worker, step, step_);
    }
    [[nodiscard]] std::vector<WorldRecord> future_bodies() const;
    void send(const WorkerMessage& message) const { send_(encode({self_, epoch_, step_}, message)); }
    [[nodiscard]] Peer peer(std::uint32_t worker) const {
        const auto found = peers_.find(worker);
        return found == peers_.end() ? Peer{} : found->second;
    }
    [[nodiscard]] std::uint64_t least_steps() const;
    [[nodiscard]] bool all_reported(std::uint64_t step) const;
    [[nodiscard]] bool comparison_is_overdue() const;
    [[nodiscard]] bool owns_bodies(std::uint32_t worker) const;

    Send send_;
    Report report_;
    std::uint32_t self_, epoch_ = 0;
    DistributedSettings settings_;
    SharedWorld world_;
    SceneClock clock_;
    BodyCosts costs_;
    ColumnWatch columns_;
    StructureFinder structures_;
    ForeignBodies foreign_;
    std::uint64_t step_ = 0, published_ = 0;
    std::vector<std::uint32_t> owner_;  // of each body, as registered
    std::set<std::uint32_t> owners_;    // workers that own any
    std::vector<std::uint32_t>
        since_;  // of each body: epoch of its owner, or of what the application sent of it
    std::vector<std::uint8_t> own_;      // of each body
    std::vector<std::uint8_t> waiting_;  // of each body: see SharedContacts::Owners
    std::vector<int> owned_, others_;    // bodies that exist and move, ascending
    std::vector<std::uint32_t> members_;
    bool owners_follow_ = true;  // not all owners are known
    SharedContacts contacts_;
    std::map<std::uint32_t, Peer> peers_;
    std::map<std::uint32_t, Touch> touched_;  // by worker
    bool late_ = false;                       // others had begun before this worker joined
    std::vector<FutureOwnership> future_;
    std::vector<Purchase> purchases_;
    std::vector<std::uint32_t> breakable_, broken_;  // constraints; those that broke in the last step
    std::vector<int> first_of_constraint_;           // the first body of each that moves
    std::map<int, ContactHistory> contact_history_;  // of own bodies that touch others'
    std::vector<std::uint8_t> sent_asleep_;          // of each body: the application knows that it sleeps
    std::vector<std::uint8_t> flat_;                 // of each body that exists: is_flat
    BorderSelection border_;
    // Of the last step; kept for their storage:
    std::vector<ForeignBall> balls_;
    std::vector<int> near_;
    std::vector<CrossImpulse> crossed_;
    WorldRecord record_;
    WorkerMessage to_application_ = UpdateMessage{}, to_neighbour_ = NeighbourMessage{};
    Update update_;
    std::vector<OwnBody> own_bodies_;
    PackedUpdates packed_;
    int ghost_age_ = 0;
    bool settled_ = false;  // the last step was published with all corrections
};

}  // namespace sim
