#pragma once
#include <deque>
#include <map>
#include <memory>
#include <set>

#include "shared/columns.h"
#include "shared/neighbour_check.h"
#include "shared/shared_contacts.h"
#include "shared/structures.h"
#include "shared/world_view.h"

namespace sim {

/// No message of a worker in this scene is larger [bytes].
[[nodiscard]] std::int64_t largest_message(const WorldScene& scene);

/// Coordinator of a shared world, without clock or transport: keeps membership and the register of owners,
/// passes messages on, and assembles the view of the whole world. All workers hear of members, owners and what was published
/// in one order: a worker is a member for all or for none, and each body has one owner. What workers tell each
/// other is passed on here, in the order in which it came, once it is known that it can be.
///
/// Bodies that do not move have no owner. Bodies that are added later have owners from the start, effective
/// from the step before which they are added.
class Coordinator {
public:
    Coordinator(const WorldScene& scene, const DistributedSettings& settings, DistributedObserver& observer);

    using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
    struct Outgoing {
        std::vector<std::uint32_t> to;
        Bytes bytes;
    };
    /// Admits a worker and returns its number. Queues its scene, then the present ownership and states.
    std::uint32_t join(const JoinRequest& request);
    void start();  ///< assigns the bodies to the members present
    /// Handles a member's message, encoded. A message that is malformed, stale, or about bodies of others
    /// is counted and dropped. A member that sends far more of them than steps need is lost. Then advance(), before the next.
    void take(std::uint32_t worker, std::span<const std::uint8_t> bytes);
    /// Goes on with the view, by what was published. Others may be told of it before, see outgoing().
    void advance();
    void lose(std::uint32_t worker,
              const std::string& why);  ///< its bodies go to the others; its later messages are dropped
    /// Removes the member whose bodies hold up the others: the one that owns a body of which the oldest state
    /// is known; or, if another one published steps of which it told that one nothing, or that one waits for bodies of another, that
    /// other. What else it has said, or published again, does not count.
    void lose_slowest(const std::string& why);
    /// Some time before that: who waits for bodies by then, and gets none, waits for the seller.
    void note_waiting();
    /// Steps that all bodies have done.
    [[nodiscard]] std::uint64_t steps() const noexcept { return view_.step(); }
    [[nodiscard]] std::vector<Outgoing> outgoing();  ///< queued messages; empties the queue
    [[nodiscard]] const std::vector<std::uint32_t>& members() const noexcept { return members_; }
    [[nodiscard]] bool is_member(std::uint32_t worker) const;
    [[nodiscard]] bool finished() const noexcept { return finished_; }  ///< all steps are done
    [[nodiscard]] const DistributedResult& result() const noexcept { return result_; }  ///< without times
    /// Owner by the register; kApplication: none.
    [[nodiscard]] std::uint32_t owner(int body) const {
        return bodies_[static_cast<std::size_t>(body)].owner;
    }

private:
    struct Body {
        std::uint32_t owner = kApplication;
        std::uint64_t step = 0;   ///< of the record
        WorldRecord record;       ///< last published
        std::uint32_t epoch = 0;  ///< of its owner
        // Its owner was asked to give it to this worker, in this step of the view; see Gather. 0: never.
        std::uint64_t asked_at = 0;
        std::uint32_t asked_to = kApplication;
    };
    struct Sender {
        std::uint64_t step = 0, bytes = 0;  ///< last published; sent since
        bool refused = false;               ///< something, and it was noted
        bool settled = false;               ///< has published the last step again
        std::uint64_t messages_at = 0;      ///< steps of all bodies since which these were sent:
        std::size_t messages = 0, message_bytes = 0, offered = 0;  ///< offered: to it, to be answered
        std::uint64_t got = 0;                                     ///< step at which it got bodies last
        std::optional<std::pair<std::uint32_t, std::uint32_t>>
            offer;  ///< its own, to be answered: to whom, number
        std::map<std::uint32_t, std::uint64_t>
            told;                ///< other members, and of which step they were told last
        DecodedMessage decoded;  ///< the last, for its storage
    };
    struct Group {
        std::uint32_t owner;
        std::uint64_t step;
        std::vector<int> bodies;
    };

    [[nodiscard]] static Bytes shared(std::span<const std::uint8_t> bytes);
    [[nodiscard]] static std::string name(std::uint32_t worker);
    void take_message(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                      WorkerMessage& message);
    void take_update(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                     const UpdateMessage& message);
    void take_last(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                   const StateMessage& message);
    void extend_sleep(const MessageHeader& header);
    void take_handover(const MessageHeader& header, Handover&& message);
    void pass_on(const MessageHeader& header, std::span<const std::uint8_t> bytes, std::uint32_t to);
    [[nodiscard]] bool has_told(std::uint32_t worker, std::uint32_t other);
    void report(const MessageHeader& header, const StepReport& report, std::size_t records,
                std::size_t bytes);
    void refuse(std::uint32_t worker, const std::string& why);
    void expel(std::uint32_t worker, const std::string& why);
    [[nodiscard]] bool is_too_much(Sender& sender, std::size_t bytes) const;
    [[nodiscard]] bool owns(std::uint32_t worker, std::uint32_t body) const;
    [[nodiscard]] bool fits(std::uint32_t body, Eigen::Index modes) const;
    [[nodiscard]] bool fits(std::uint32_t worker, const std::vector<WorldRecord>& records) const;
    [[nodiscard]] bool fits(const std::vector<Mishap>& mishaps) const;
    [[nodiscard]] bool owns_constraint(std::uint32_t worker, int constraint) const;
    [[nodiscard]] bool may_offer(std::uint32_t worker, const Offer& offer) const;
    void take_offer(const MessageHeader& header, std::span<const std::uint8_t> bytes, const Offer& offer);
    void take_answer(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                     const OfferAnswer& answer);
    static void publish(Body& body, const WorldRecord& record, std::uint64_t step);

    void remove(std::uint32_t worker);
    [[nodiscard]] std::map<std::uint32_t, std::vector<int>> shares(
        const std::vector<int>& bodies, const std::vector<std::uint32_t>& workers) const;
    void share_out(const std::vector<int>& bodies, std::uint32_t from);
    [[nodiscard]] std::vector<int> owned_by(std::uint32_t worker) const;
    [[nodiscard]] std::vector<std::vector<int>> whole_lots() const;
    [[nodiscard]] std::vector<int> there_now() const;
    [[nodiscard]] std::vector<std::vector<int>> flat_structures_now() const;
    [[nodiscard]] std::vector<Eigen::Vector3d> places(const std::vector<std::vector<int>>& lots) const;
    [[nodiscard]] std::vector<Group> groups(const std::vector<int>& bodies) const;
    /// traded: a buyer has got them.
    void register_owner(const std::vector<int>& bodies, std::uint32_t owner, std::uint32_t from,
                        bool traded = false);
    [[nodiscard]] Ownership ownership(const Group& group) const;
    void add_what_is_around(Ownership& message) const;
    void catch_up(std::uint32_t worker);
    void tell_ready();
    void release();
    void gather();
    void ask_who_leaves();
    [[nodiscard]] std::vector<std::uint32_t> staying() const;
    [[nodiscard]] bool ask_for(std::uint32_t body, std::uint32_t to);
    void end(bool rest);
    void name_mishaps(DistributedResult& result) const;

    void send(std::vector<std::uint32_t> to, const WorkerMessage& message);

    WorldScene scene_;
    DistributedSettings settings_;
    DistributedObserver* observer_;
    WorldView view_;
    Columns columns_;
    PlannedStructures planned_;
    std::vector<std::vector<int>> lots_;  // tied together
    std::vector<Body> bodies_;
    std::vector<std::uint32_t> gone_;  // whose messages need no storage any more
    std::vector<std::uint32_t> members_;
    std::set<std::uint32_t> leaving_;  // of these
    std::map<std::uint32_t, Sender> senders_;
    std::uint32_t next_worker_ = 0, epoch_ = 0;
    bool started_ = false, finished_ = false;
    std::vector<Outgoing> queue_;
    NeighbourCheck check_;
    std::deque<PastSale> sales_;  // see PastMessage
    /// Who waits for bodies that it bought of whom; whether that was so for long, see note_waiting.
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> bought_;
    /// Mishaps as workers told them first, by body or constraint.
    std::map<int, QuarantinedBody> quarantined_;
    std::map<int, std::uint64_t> limited_, broken_;
    std::vector<std::pair<std::uint32_t, std::vector<int>>>
        orphans_;  // by the lost worker that owned them; if none was left
    std::map<std::uint32_t, Eigen::Vector3d> outside_;  // of each worker since its start
    DistributedResult result_;
};

}  // namespace sim
