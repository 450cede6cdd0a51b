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

/// Coordinator of a shared world, without clock or transport. It keeps the members and the register of
/// owners, relays messages between workers once it has checked them, and assembles the view of the whole
/// world. All workers receive members, owners and relayed messages in one order. So a worker is a member for
/// all others or for none, and each body has one owner.
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
    /// Handles a member's encoded message. A stale message is counted and dropped. A member is lost if it
    /// sends a malformed message, states of bodies that it does not own, or far more messages than its steps
    /// need. Call advance() before the next message.
    void receive(std::uint32_t worker, std::span<const std::uint8_t> bytes);
    /// Advances the view by what was published. outgoing() may be sent before.
    void advance();
    /// Removes a member. Its bodies go to the others; its later messages are dropped.
    void lose(std::uint32_t worker, const std::string& why);
    /// Removes the member that holds up the others. This is the owner of the body whose last published state
    /// is the oldest, unless that owner waits for another member: for its border data of a step that it has
    /// published, or for bodies that it has sold. Then it is that other one.
    void lose_slowest(const std::string& why);
    /// To be called some time before lose_slowest. A buyer that waits for bodies at both times waits for the
    /// seller.
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
        // The owner was asked to give the body to this worker, in this step of the view (Gather). 0: never.
        std::uint64_t asked_at = 0;
        std::uint32_t asked_to = kApplication;
    };
    struct Sender {
        std::uint64_t step = 0, bytes = 0;  ///< last step that it published; bytes that it sent since
        bool refused = false;               ///< a refused message was noted
        bool settled = false;               ///< it has published the last step again
        // Messages while the view is at this step, and offers of others that it has to answer:
        std::uint64_t counted_at = 0;
        std::size_t messages = 0, message_bytes = 0, offers = 0;
        std::uint64_t gained_at = 0;  ///< step at which it got bodies last
        /// The buyer and the number of its own offer that is not answered.
        std::optional<std::pair<std::uint32_t, std::uint32_t>> offer;
        std::map<std::uint32_t, std::uint64_t> sent;  ///< step of the last border data, by receiver
        DecodedMessage decoded;                       ///< the last message; kept for its storage
    };
    /// Bodies with one owner and one step of their records.
    struct Group {
        std::uint32_t owner;
        std::uint64_t step;
        std::vector<int> bodies;
    };

    [[nodiscard]] static Bytes shared(std::span<const std::uint8_t> bytes);
    [[nodiscard]] static std::string name(std::uint32_t worker);
    void handle(const MessageHeader& header, std::span<const std::uint8_t> bytes, WorkerMessage& message);
    void handle_update(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                       const UpdateMessage& message);
    void handle_last(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                     const StateMessage& message);
    void extend_sleep(const MessageHeader& header);
    void handle_handover(const MessageHeader& header, Handover&& message);
    void relay(const MessageHeader& header, std::span<const std::uint8_t> bytes, std::uint32_t to);
    [[nodiscard]] bool has_sent_all(std::uint32_t worker, std::uint32_t other);
    void report(const MessageHeader& header, const StepReport& report, std::size_t records,
                std::size_t bytes);
    void refuse(std::uint32_t worker, const std::string& why);
    void expel(std::uint32_t worker, const std::string& why);
    [[nodiscard]] bool is_too_much(Sender& sender, std::size_t bytes) const;
    [[nodiscard]] bool owns(std::uint32_t worker, std::uint32_t body) const;
    [[nodiscard]] bool is_valid(std::uint32_t body, Eigen::Index modes) const;
    [[nodiscard]] bool is_valid(std::uint32_t worker, const std::vector<WorldRecord>& records) const;
    [[nodiscard]] bool is_valid(const std::vector<Mishap>& mishaps) const;
    [[nodiscard]] bool owns_constraint(std::uint32_t worker, int constraint) const;
    [[nodiscard]] bool may_offer(std::uint32_t worker, const Offer& offer) const;
    void handle_offer(const MessageHeader& header, std::span<const std::uint8_t> bytes, const Offer& offer);
    void handle_answer(const MessageHeader& header, std::span<const std::uint8_t> bytes,
                       const OfferAnswer& answer);
    static void publish(Body& body, const WorldRecord& record, std::uint64_t step);

    void remove(std::uint32_t worker);
    [[nodiscard]] std::map<std::uint32_t, std::vector<int>> plan_distribution(
        const std::vector<int>& bodies, const std::vector<std::uint32_t>& workers) const;
    void distribute(const std::vector<int>& bodies, std::uint32_t from);
    [[nodiscard]] std::vector<int> owned_by(std::uint32_t worker) const;
    [[nodiscard]] std::vector<std::vector<int>> whole_groups() const;
    [[nodiscard]] std::vector<int> existing_bodies() const;
    [[nodiscard]] std::vector<Eigen::Vector3d> places(const std::vector<std::vector<int>>& groups) const;
    [[nodiscard]] std::vector<Group> by_owner(const std::vector<int>& bodies) const;
    /// `traded`: a buyer gets the bodies.
    void register_owner(const std::vector<int>& bodies, std::uint32_t owner, std::uint32_t from,
                        bool traded = false);
    [[nodiscard]] Ownership ownership(const Group& group) const;
    void add_surroundings(Ownership& message) const;
    void send_history(std::uint32_t worker);
    void begin_next_step();
    void release_settled();
    void consolidate_structures();
    void ask_leaving_members();
    [[nodiscard]] std::vector<std::uint32_t> staying_members() const;
    [[nodiscard]] bool mark_asked(std::uint32_t body, std::uint32_t to);
    void end(bool rest);
    void list_mishaps(DistributedResult& result) const;

    void send(std::vector<std::uint32_t> to, const WorkerMessage& message);

    WorldScene scene_;
    DistributedSettings settings_;
    DistributedObserver* observer_;
    WorldView view_;
    Columns columns_;
    StructureFinder structures_;
    std::vector<std::vector<int>> groups_;  // bodies that are tied together
    std::vector<Body> bodies_;
    std::vector<std::uint32_t> gone_;  // removed members whose messages are still stored
    std::vector<std::uint32_t> members_;
    std::size_t most_members_ = 0;     ///< at any time
    std::set<std::uint32_t> leaving_;  // members that want to leave
    std::map<std::uint32_t, Sender> senders_;
    std::uint32_t next_worker_ = 0, epoch_ = 0;
    bool started_ = false, finished_ = false;
    std::vector<Outgoing> queue_;
    NeighbourCheck check_;
    std::deque<PastSale> sales_;  // see PastMessage
    /// Pairs of a buyer and a seller whose bodies have not come; whether that was so at note_waiting().
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> awaited_;
    // The first report of each mishap, by body or constraint.
    std::map<int, QuarantinedBody> quarantined_;
    std::map<int, std::uint64_t> limited_, broken_;
    std::vector<std::pair<std::uint32_t, std::vector<int>>>
        orphans_;  // bodies of lost workers, by the worker, while there is no member
    std::map<std::uint32_t, Eigen::Vector3d> outside_;  // of each worker since its start
    DistributedResult result_;
};

}  // namespace sim
