#pragma once
#include <map>
#include <utility>
#include <vector>

#include "messages/worker_messages.h"
#include "world/shared_world.h"

namespace sim {

/// The impulses that hold a body are averaged over so many steps before they are sent. With the impulses of
/// one step alone, two owners of a stack make each other swing more and more
/// (tests/sim/shared/shared_stack_test.cpp).
constexpr int kHeldSteps = 32;

/// The order of impulses between own bodies and others'.
[[nodiscard]] std::pair<int, int> bodies_of(const CrossImpulse& c);
/// In impulses of this order; nullptr: there is none between these two.
[[nodiscard]] const CrossImpulse* find_pair(const std::vector<CrossImpulse>& crossed, int own, int ghost);

/// What one worker has received from the others: their messages of the last steps. From them follow the
/// states of their bodies at any of these steps.
class ForeignBodies {
public:
    /// `world` provides body kinds and the step of free motion; its state is not changed.
    ForeignBodies(SharedWorld& world, std::uint32_t self, int bodies, int keep_steps);

    /// What a worker sent of one step. Of this worker itself only `crossed` is kept.
    struct ReceivedStep {
        std::uint64_t step = 0;
        bool complete = false;  ///< its message has come, or none will come
        std::uint64_t acknowledged =
            0;  ///< step of this worker's last message that the sender had received by then
        PackedUpdates bodies;
        std::vector<CrossImpulse> crossed;
    };
    /// Keeps the message of a worker's step; steps of a worker ascend. `owner`: registered owner of each
    /// body. States of bodies that the sender does not own any more are ignored.
    void receive(std::uint32_t worker, std::uint64_t step, NeighbourMessage&& message,
                 const std::vector<std::uint32_t>& owner);
    void keep_own(std::uint64_t step, const std::vector<CrossImpulse>& crossed);
    /// No message of a worker's steps up to this one will come. add_found() may still add impulses to them.
    void expect_nothing_until(std::uint32_t worker, std::uint64_t step);
    /// Adds impulses that a worker found in a step and has not sent before.
    void add_found(std::uint32_t worker, const FoundStep& found);
    /// The impulses that this worker found at these bodies (ascending) in the steps that it keeps, on either
    /// side.
    [[nodiscard]] std::vector<FoundStep> found_at(const std::vector<int>& bodies) const;
    /// A body exists from the end of step `step` on. A state that another worker sent before is kept.
    void add_body(const WorldRecord& record, std::uint64_t step);
    /// Sets a body's state at the end of step `step`, as registered or as this worker knows it.
    void set(const WorldRecord& record, std::uint64_t step);
    /// nullptr: nothing was received of that step, or it is kept no more.
    [[nodiscard]] const ReceivedStep* received(std::uint32_t worker, std::uint64_t step) const;
    /// By worker; a step's place is its remainder by the number of steps that are kept.
    [[nodiscard]] const std::map<std::uint32_t, std::vector<ReceivedStep>>& all() const noexcept {
        return received_;
    }

    /// State at step `now`, extrapolated from the last state that is known up to then (else from the
    /// earliest). A body that its owner's bodies hold keeps its velocity. Another one moves freely, with the
    /// impulses that own bodies gave it in these steps.
    struct Ghost {
        WorldBodyState state;
        bool asleep = false;
        int age = 0;       ///< of the state from which it is extrapolated [steps]
        StepImpulse held;  ///< mean impulse of its owner's other bodies in a step, for the next step
    };
    /// The result is valid until the next call.
    [[nodiscard]] const Ghost& at(int body, std::uint64_t now);
    /// A ball that contains the body over the step after `now`.
    [[nodiscard]] ForeignBall ball(int body, std::uint64_t now);
    [[nodiscard]] bool known(int body) const { return latest(body).known; }

    // By the latest state that was received.
    [[nodiscard]] bool asleep(int body) const { return latest(body).pose.asleep; }
    [[nodiscard]] bool quarantined(int body) const { return latest(body).pose.quarantined; }
    [[nodiscard]] std::uint64_t latest_step(int body) const { return latest(body).step; }
    [[nodiscard]] Eigen::Vector3d latest_position(int body) const {
        return latest(body).pose.position;
    }  ///< [m]

private:
    struct KnownState {
        std::uint64_t step = 0;
        Update update;
        std::uint32_t worker = kApplication;  ///< which sent it
        std::uint64_t acknowledged = 0;       ///< see ReceivedStep
    };
    struct Pose {
        Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = position;  // [m], [m/s]
        bool asleep = false, quarantined = false;
    };
    struct Latest {
        std::uint64_t step = 0;
        std::uint32_t worker = kApplication;  // which sent it; kApplication: it is in registered_
        bool known = false;
        Pose pose = {};
        std::size_t index = 0;  // in the message
        // The worker that sent states before this one, and the step of its last one.
        std::uint32_t worker_before = kApplication;
        std::uint64_t step_before = 0;
    };
    struct Found {
        const ReceivedStep* message = nullptr;
        std::size_t index = 0;  // of the body
        std::uint32_t worker = kApplication;
    };
    [[nodiscard]] Latest& latest(int body) { return latest_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] const Latest& latest(int body) const { return latest_[static_cast<std::size_t>(body)]; }
    ReceivedStep* slot(std::uint32_t worker, std::uint64_t step);
    void set_latest(int body, std::uint64_t step, std::uint32_t worker, const Pose& pose, std::size_t index);
    [[nodiscard]] Found last_until(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t now,
                                   std::size_t index) const;
    [[nodiscard]] static bool is_nearer(const KnownState& registered, std::uint64_t step, std::uint64_t now);
    void find_base(int body, std::uint64_t now);
    void add_rebounds_unknown_to_owner(int body);
    void extrapolate(int body, std::uint64_t now);

    SharedWorld* world_;
    std::uint32_t self_;
    double dt_, gravity_;
    std::size_t keep_;
    std::map<std::uint32_t, std::vector<ReceivedStep>> received_;  // see all()
    std::vector<Latest> latest_;                                   // by body
    std::vector<double> radius_;  // by body that exists: of a ball that contains it, deformed or not
    std::map<int, KnownState> registered_;  // of bodies that were registered or fell asleep
    // Of the ghost that is being computed:
    KnownState base_;  // the state from which it is extrapolated
    Ghost ghost_;
};

}  // namespace sim
