#pragma once
#include <vector>

#include "sim/distributed_world.h"

namespace sim {

/// A scene's schedule: applies its events and knows at which step each body is added.
class SceneClock {
public:
    explicit SceneClock(const WorldScene& scene);  ///< at the start

    /// Applies the events due before step `step` + 1: removes constraints that still hold, adds bodies.
    /// Whether there were any.
    bool apply(World& world, std::uint64_t step);
    /// Events, or forces and prescribed motions that have not ended.
    [[nodiscard]] bool events_left() const noexcept { return next_ < scene_.events.size() || busy_; }
    [[nodiscard]] int bodies() const noexcept { return static_cast<int>(born_.size()); }  ///< with later ones
    /// Step at whose end the body first exists; the next step is the first it takes part in.
    [[nodiscard]] std::uint64_t born(int body) const { return born_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] bool moves(int body) const { return moves_[static_cast<std::size_t>(body)] != 0; }
    /// Whether the body takes part in the steps up to this one.
    [[nodiscard]] bool there_at(int body, std::uint64_t step) const {
        return body < first_later_ || born(body) < step;
    }
    [[nodiscard]] bool moves_at(int body, std::uint64_t step) const {
        return moves(body) && there_at(body, step);
    }

private:
    WorldScene scene_;
    std::size_t next_ = 0;
    double busy_until_s_ = 0;
    bool busy_ = true;  // a step that was applied begins before that
    int first_later_ = 0;
    std::vector<std::uint64_t> born_;
    std::vector<std::uint8_t> moves_;
};

/// Whether it has slept, or been slow, for half a second, in steps of dt [s].
[[nodiscard]] bool is_still(const WorldRecord& record, double dt) noexcept;

}  // namespace sim
