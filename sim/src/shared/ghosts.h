#pragma once
#include <memory>

#include "messages/world_messages.h"
#include "shared/impulse_log.h"

namespace sim {

/// What one worker knows of the others' bodies in bounded pace: their updates, and where they are at any step
/// near these.
class Ghosts {
public:
    /// The world lends kinds and the free step; its own state is not touched.
    Ghosts(World& world, const ImpulseLog& pushes, std::uint32_t self, int bodies, int bound);

    /// An update message of step `step`, or what stands for one.
    void take(std::uint64_t step, const std::shared_ptr<const PackedUpdates>& message);
    void take(std::uint64_t step, const UpdateMessage& message);
    /// From now on seen at `step` as the world has it.
    void take_own(int body, std::uint64_t step, std::vector<std::uint32_t> sources,
                  std::vector<std::uint64_t> applied);

    /// The body at step `now`, by the last update not later than that (or the earliest there is): what its
    /// owner assumed of pushes is put right, then it moves freely under what lasts and the pushes.
    struct Ghost {
        WorldBodyState state;
        bool asleep = false;
        int age = 0;            ///< of the update [steps]
        bool leant_on = false;  ///< other bodies of its owner touch it
        StepImpulse held;       ///< over the next step, pushes of this worker's own bodies apart
    };
    [[nodiscard]] Ghost at(int body, std::uint64_t now);
    /// A ball that holds the body over the step after `now`.
    [[nodiscard]] ForeignBall ball(int body, std::uint64_t now) const;
    [[nodiscard]] bool known(int body) const { return newest_[static_cast<std::size_t>(body)].known; }
    /// Step of the last update; 0: the start, or none.
    [[nodiscard]] std::uint64_t newest(int body) const {
        return newest_[static_cast<std::size_t>(body)].step;
    }
    [[nodiscard]] bool quarantined(int body) const;
    [[nodiscard]] Eigen::Vector3d last_position(int body) const;

private:
    struct Seen {
        std::uint64_t step;
        std::shared_ptr<const PackedUpdates> message;
        std::uint32_t offset;
    };
    struct Newest {
        std::uint64_t step = 0;
        bool known = false;
        PackedUpdates::Glance glance = {};
    };
    [[nodiscard]] const Seen& seen_at(int body, std::uint64_t now) const;
    [[nodiscard]] static std::uint64_t applied(const Seen& seen, std::uint32_t source);
    void put_right(int body, const Seen& seen, WorldBodyState& state);

    World* world_;
    const ImpulseLog* pushes_;
    std::uint32_t self_;
    double dt_ = 0, gravity_ = 0;
    std::vector<Newest> newest_;           // by body
    std::vector<std::vector<Seen>> seen_;  // by body, ascending steps
    std::size_t keep_;                     // of them
};

}  // namespace sim
