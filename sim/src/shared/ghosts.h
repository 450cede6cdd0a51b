#pragma once
#include <memory>

#include "messages/world_messages.h"
#include "shared/impulse_log.h"

namespace sim {

/// One worker's knowledge of other workers' bodies in bounded pace: their updates, and their extrapolated
/// states at any step near these.
class Ghosts {
public:
    /// `world` provides body kinds and the step of free motion; its state is not changed.
    Ghosts(World& world, const ImpulseLog& pushes, std::uint32_t self, int bodies, int bound);

    /// Stores an update message of step `step`, packed or decoded.
    void take(std::uint64_t step, const std::shared_ptr<const PackedUpdates>& message);
    void take(std::uint64_t step, const UpdateMessage& message);
    /// Sets the body's last known state to the world's current one, stamped `step`.
    void take_own(int body, std::uint64_t step, std::vector<std::uint32_t> sources,
                  std::vector<std::uint64_t> applied);

    /// State at step `now`: the last update not later than that (or the earliest there is), corrected by
    /// impulses that arrived late, then integrated freely under lasting forces and known impulses.
    struct Ghost {
        WorldBodyState state;
        bool asleep = false;
        int age = 0;            ///< of the update [steps]
        bool leant_on = false;  ///< other bodies of its owner are in contact with it
        StepImpulse held;       ///< force over the next step, without this worker's own impulses
    };
    [[nodiscard]] Ghost at(int body, std::uint64_t now);
    /// A ball that holds the body over the step after `now`.
    [[nodiscard]] ForeignBall ball(int body, std::uint64_t now) const;
    [[nodiscard]] bool known(int body) const { return newest_[static_cast<std::size_t>(body)].known; }
    /// Step of the last update; 0: the start, or none.
    [[nodiscard]] std::uint64_t newest(int body) const {
        return newest_[static_cast<std::size_t>(body)].step;
    }
    [[nodiscard]] bool quarantined(int body) const;               ///< as last published
    [[nodiscard]] Eigen::Vector3d last_position(int body) const;  ///< as last published [m]

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
