#pragma once
#include "world/shared_world.h"
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "shared/body_costs.h"
#include "shared/columns.h"
#include "shared/neighbour_telling.h"
#include "run/scene_clock.h"
#include "shared/shared_contacts.h"
#include "shared/structures.h"

namespace sim {

/// How one worker keeps its copy of the world consistent with the others'. Uses no clock, no sockets and no load
/// balancing. A body is own, foreign, or given (handed over, but not yet registered elsewhere: no worker steps it).
///
/// Every worker is at a step of its own. Its world holds its bodies; of the others' bodies those that may come
/// near are put in as ghosts for each step, and move with them.
///
/// After a step it tells every other worker which of its bodies may come near that one's, as far as it knows where these are, and
/// what it found at contacts with them; the application is told of all bodies. A body that is not named is far away. What sleeps is
/// told once to each, when it is near, and once more when it wakes.
///
/// Bodies change owners at a step which all other owners have told the seller, see may_give: so it has compared with them what was found
/// up to there, and the buyer compares what comes after. Who does not know yet of a sale tells the seller what it finds at these bodies;
/// as soon as it knows it tells the buyer (FoundMessage). Until all have done so the buyer
/// compares nothing of them. As the application passes on all that is said in one order, what a worker says that knows of a sale
/// comes when this one knows of it, too, and has heard the seller up to it.
///
/// A contact between bodies of two owners is resolved by both (SharedContacts), and workers whose bodies touch keep closer to
/// each other (touching_lead).
class BoundedExchange {
public:
    explicit BoundedExchange(const SceneMessage& scene);

    /// How encoded messages leave, to the application; to be set before anything else.
    using Send = std::function<void(std::vector<std::uint8_t>&&)>;
    void send_by(Send send) { send_ = std::move(send); }
    /// What another worker reports of a step: its header, the seconds of a step, the number of its bodies.
    using Report = std::function<void(const MessageHeader&, double smoothed_s, std::uint32_t own)>;
    void report_to(Report report) { report_ = std::move(report); }

    /// What another worker says, once the application has checked it (NeighbourCheck).
    void take(const MessageHeader& header, NeighbourMessage&& message);
    void take(const MessageHeader& header, FoundMessage&& message);
    /// Once, before the first step of one who joins late.
    void take(const MessageHeader& header, const PastMessage& message);
    /// The members now, and the epoch in which the application says so. Workers that left own nothing from here on;
    /// Ownership messages say who owns their bodies.
    void members(const Members& message, std::uint32_t epoch);
    /// Registered owners, in this epoch. Becomes effective at the message's step: this worker may have to take over
    /// bodies that are some steps away.
    void own(const Ownership& ownership, std::uint32_t epoch);
    /// Bodies came to this worker after its last step, which nobody has published of them. Who came to the last step by
    /// taking bodies over has to say so, and where it is who goes on to a step in which bodies come.
    [[nodiscard]] bool owes() const {
        return published_ < step_ && (owned_.empty() ? owners_.contains(self_) : at_end());
    }

    /// Whether the next step can be done now: its inputs have arrived and the bound allows it. False if
    /// done(), or if no body is own.
    [[nodiscard]] bool ready() const;
    void step();  ///< requires ready()
    /// Sends the messages of the step just done. Called once after step(), and where it owes().
    void publish(std::uint32_t epoch, const StepReport& report);
    /// Without own bodies: advances as far as the others' messages allow.
    void follow();

    [[nodiscard]] Holdings holdings();  ///< who has what where, for load balancing
    /// Whether what is own may be given: all is known that others found at it up to this step.
    [[nodiscard]] bool may_give() const;
    /// That another worker has done, as far as is known.
    [[nodiscard]] std::uint64_t steps_of(std::uint32_t worker) const { return known(worker); }
    /// Stops owning: their exact records at the end of this worker's last step. The caller sends the
    /// Handover.
    [[nodiscard]] Handover give(const std::vector<std::uint32_t>& bodies);
    /// After a step: notes what each own body costs, for load balancing.
    void weigh() { costs_.add(world_, owned_); }

    [[nodiscard]] std::uint64_t steps_done() const { return step_; }  ///< by this worker
    [[nodiscard]] bool at_end() const { return step_ >= settings_.steps; }
    /// Nothing is left to do. One more publication follows the last step, once all others have done theirs:
    /// corrected by the impulses that arrived late.
    [[nodiscard]] bool done() const { return at_end() && settled_; }
    [[nodiscard]] int own_bodies() const { return static_cast<int>(owned_.size()); }
    /// No body is own, or will be in some steps.
    [[nodiscard]] bool has_nothing() const { return owned_.empty() && later_.empty() && !owners_follow_; }
    [[nodiscard]] int lead() const;                             ///< steps ahead of the slowest owner, now
    [[nodiscard]] int ghost_age() const { return ghost_age_; }  ///< of the oldest used in the last step
    [[nodiscard]] const SharedWorld& world() const { return world_; }
    void use_threads(int threads) { world_.use_threads(threads); }  ///< see World::use_threads

private:
    struct Felt {                   // what other bodies of this worker do to an own one
        StepImpulse mean;           // of a step
        int steps = 0;              // that it is of
        std::uint64_t held = 0;     // step in which they last did anything
        std::uint64_t touched = 0;  // step in which it last touched another worker's
        bool watched = false;       // in the step
    };
    void come_to(std::uint64_t step);
    void list();
    void set_own(int body, bool own);
    struct Later {
        Ownership ownership;
        std::uint32_t epoch;
    };
    void take_over(const Later& later);
    void take_due();
    void place_ghosts();
    void keep_crossed();
    void feel();
    void publish_last(const StepReport& report) const;
    void tell_neighbours(const StepReport& report);
    void tell(std::uint32_t worker);
    void tell(int body, Update& update);
    void see(int body, const WorldBodyState& state, bool asleep);
    void pack(std::size_t which);
    [[nodiscard]] bool is_told(int body) const;
    void take_around(const Ownership& ownership);
    void bought(std::vector<int>&& bodies, std::uint32_t epoch);
    void complete();
    void compare(std::uint32_t worker, std::uint64_t step) {
        if (step <= step_) contacts_.compare(worker, step, step_);
    }
    void see_own();
    [[nodiscard]] std::vector<WorldRecord> coming() const;
    void send(const WorkerMessage& message) const { send_(encode({self_, epoch_, step_}, message)); }
    [[nodiscard]] std::uint64_t known(std::uint32_t worker) const {
        const auto found = known_.find(worker);
        return found == known_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint64_t told(std::uint32_t worker) const {
        const auto found = told_.find(worker);
        return found == told_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint32_t epoch_of(std::uint32_t worker) const {
        const auto found = knows_.find(worker);
        return found == knows_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint64_t slowest() const;
    [[nodiscard]] bool all_is_told(std::uint64_t step) const;
    [[nodiscard]] bool begins_at(std::uint32_t worker, std::uint64_t step) const;
    [[nodiscard]] bool is_waited_for() const;
    [[nodiscard]] bool owns_any(std::uint32_t worker) const;

    Send send_;
    Report report_;
    std::uint32_t self_, epoch_ = 0;
    DistributedSettings settings_;
    SharedWorld world_;
    SceneClock clock_;
    BodyCosts costs_;
    ColumnWatch columns_;
    PlannedStructures planned_;
    ForeignBodies foreign_;
    std::uint64_t published_ = 0;  // step
    std::uint64_t step_ = 0;
    std::vector<std::uint32_t> owner_;  // as registered
    std::set<std::uint32_t> owners_;    // who has any
    std::vector<std::uint32_t> since_;  // bodies: epoch of that, or in which the application told of them
    std::vector<std::uint8_t> own_, awaits_;  // awaits_: own, and what others found at it is not known
    std::vector<int> owned_, others_;         // there, ascending; moving ones of others
    std::vector<std::uint32_t> members_;
    bool owners_follow_ = true;  // not all owners are known
    SharedContacts contacts_;
    std::map<std::uint32_t, std::uint64_t> known_;  // workers: step that they have done
    std::map<std::uint32_t, std::uint64_t> told_;   // workers: step of their last message
    std::map<std::uint32_t, std::uint32_t> knows_;  // workers: epoch of their last message
    std::map<std::uint32_t, std::uint64_t>
        begun_;          // workers that owned nothing before: step in which they got bodies
    bool late_ = false;  // others were under way before this one came
    std::vector<Later> later_;
    std::vector<ForeignBall> balls_;
    std::vector<int> near_;
    std::vector<CrossImpulse> crossed_;              // in the last step
    WorldRecord record_;                             // of the body that is being told of
    std::vector<std::uint32_t> breakable_, broken_;  // constraints; those that broke in the last step
    std::vector<int> first_of_constraint_;           // the first body of each that moves
    std::map<int, Felt> felt_;                       // of own bodies that touch others'
    std::vector<std::uint8_t> told_asleep_;          // the application was
    // Kept for their storage:
    WorkerMessage outgoing_ = UpdateMessage{}, to_neighbour_ = NeighbourMessage{};
    Update update_;
    NeighbourTelling telling_;
    struct Packed {  // of each own body, as seen by telling_
        int body;
        std::int32_t update = -1, at = -1;  // in the message to the application, in packed_; -1: not there
    };
    std::vector<Packed> seen_;
    PackedUpdates packed_;            // as neighbours need them
    std::vector<std::uint8_t> flat_;  // bodies that are there: is_flat
    /// Own bodies at which others have found what they have not yet told.
    struct Purchase {
        std::uint32_t epoch;
        std::set<std::uint32_t> silent;  // workers
        std::vector<int> bodies = {};
        std::optional<std::uint64_t> step = {};  // up to which it is compared; none: they are not there yet
        [[nodiscard]] bool is_complete() const { return step && silent.empty(); }
    };
    std::vector<Purchase> purchases_;
    struct Touch {
        std::uint64_t step = 0;  // in which their bodies and own ones last touched
        int pairs = 0;           // of bodies, then
    };
    std::map<std::uint32_t, Touch> touched_;  // workers
    int ghost_age_ = 0;
    bool settled_ = false;
};

}  // namespace sim
