#pragma once
#include <map>
#include <memory>
#include <vector>

#include "messages/worker_messages.h"
#include "world/shared_world.h"

namespace sim {

/// Steps over which the impulses that hold a body are averaged before they are told. With those of one step alone two owners of
/// a stack swing each other up (tests/sim/shared/shared_stack_test.cpp).
constexpr int kHeldSteps = 32;

/// What one worker has heard of the others: their messages of the last steps, and from them the states of
/// those of their bodies that are near at any step near these.
class ForeignBodies {
public:
    /// `world` provides body kinds and the step of free motion; its state is not changed.
    ForeignBodies(SharedWorld& world, std::uint32_t self, int bodies, int keep_steps);

    /// What a worker said of a step. Own messages hold only `crossed`.
    struct Heard {
        std::uint64_t step = 0;
        bool there = false;       ///< its message has come, or none will
        std::uint64_t heard = 0;  ///< step of this worker's last message that it had heard by then
        PackedUpdates bodies;
        std::vector<CrossImpulse> crossed;
    };
    /// Of later steps from time to time. owner: of each body, as registered. Of others' bodies the sender has sold, and knows less by now.
    void take(std::uint32_t worker, std::uint64_t step, NeighbourMessage&& message,
              const std::vector<std::uint32_t>& owner);
    void keep_own(std::uint64_t step, const std::vector<CrossImpulse>& crossed);
    /// Of a worker's steps up to this one nothing more will come but what add() takes.
    void nothing_until(std::uint32_t worker, std::uint64_t step);
    /// What a worker found in a step, beside what it has told of that.
    void add(std::uint32_t worker, const FoundStep& found);
    /// What this worker found at these bodies (ascending), its own and others, in the steps that it keeps.
    [[nodiscard]] std::vector<FoundStep> found_at(const std::vector<int>& bodies) const;
    /// A body that is there from the end of step `step` on; others may have told of it.
    void born(const WorldRecord& record, std::uint64_t step);
    /// Sets the body's state at the end of step `step`, from the register or from here.
    void set(const WorldRecord& record, std::uint64_t step);
    /// Of a step; nullptr: not heard, or forgotten.
    [[nodiscard]] const Heard* heard(std::uint32_t worker, std::uint64_t step) const;
    [[nodiscard]] const std::map<std::uint32_t, std::vector<Heard>>& all() const noexcept { return heard_; }

    /// State at step `now`: as last told before or then (or the earliest there is). From there bodies that others hold go on
    /// with the velocity that they had; others move freely, with what own bodies gave them in these steps.
    struct Ghost {
        WorldBodyState state;
        bool asleep = false;
        int age = 0;       ///< of what was told [steps]
        StepImpulse held;  ///< force over the next step: the mean one of its owner's other bodies
    };
    /// What is returned holds until the next call.
    [[nodiscard]] const Ghost& at(int body, std::uint64_t now);
    /// A ball that holds the body over the step after `now`.
    [[nodiscard]] ForeignBall ball(int body, std::uint64_t now);
    [[nodiscard]] bool known(int body) const { return newest_[static_cast<std::size_t>(body)].known; }
    [[nodiscard]] bool asleep(int body) const {
        return newest_[static_cast<std::size_t>(body)].glance.asleep;
    }
    [[nodiscard]] std::uint64_t newest(int body) const {
        return newest_[static_cast<std::size_t>(body)].step;
    }  ///< step of what was told last
    [[nodiscard]] bool quarantined(int body) const {
        return newest_[static_cast<std::size_t>(body)].glance.quarantined;
    }
    [[nodiscard]] Eigen::Vector3d last_position(int body) const {
        return newest_[static_cast<std::size_t>(body)].glance.position;
    }  ///< as last told [m]

private:
    struct Told {
        std::uint64_t step = 0;
        Update update;
        std::uint32_t worker = kApplication;  ///< who told it
        std::uint64_t heard = 0;              ///< see Heard
    };
    struct Glance {
        Eigen::Vector3d position = Eigen::Vector3d::Zero(), velocity = position;  // [m], [m/s]
        bool asleep = false, quarantined = false;
    };
    struct Newest {
        std::uint64_t step = 0;
        std::uint32_t worker = kApplication;  // that told it; the application: see rest_
        bool known = false;
        Glance glance = {};
        std::size_t index = 0;  // in the message
        // Who told it before, up to which step.
        std::uint32_t worker_before = kApplication;
        std::uint64_t step_before = 0;
    };
    struct Message {
        const Heard* heard = nullptr;
        std::size_t index = 0;  // of the body
        std::uint32_t worker = kApplication;
    };
    Heard* slot(std::uint32_t worker, std::uint64_t step);
    void tell(int body, std::uint64_t step, std::uint32_t worker, const Glance& glance, std::size_t index);
    [[nodiscard]] Message last_until(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t now,
                                     std::size_t index) const;
    [[nodiscard]] static bool counts(const Told& rest, std::uint64_t step, std::uint64_t now);
    void find_told(int body, std::uint64_t now);
    void add_owed(int body);
    void extrapolate(int body, std::uint64_t now);

    SharedWorld* world_;
    std::uint32_t self_;
    double dt_, gravity_;
    std::size_t keep_;
    std::map<std::uint32_t, std::vector<Heard>> heard_;  // by worker; a step's place is its remainder
    std::vector<Newest> newest_;                         // by body
    std::vector<double>
        radius_;                // likewise, of those that are there: of a ball that holds it, deformed or not
    std::map<int, Told> rest_;  // of bodies that were registered, or told to sleep
    // Of the ghost that is being made:
    Told told_;
    Ghost ghost_;
};

}  // namespace sim
