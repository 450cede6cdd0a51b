#pragma once
#include <map>
#include <span>
#include <vector>

#include "messages/world_messages.h"

namespace sim {

/// A scene's schedule: applies its events and knows at which step each body is added.
class SceneClock {
public:
    explicit SceneClock(const WorldScene& scene);  ///< at the start

    /// Applies the events due before step `step` + 1: removes constraints that still hold, adds bodies.
    void apply(World& world, std::uint64_t step);
    /// Events, or forces and prescribed motions that have not ended.
    [[nodiscard]] bool events_left() const noexcept { return next_ < scene_.events.size() || busy_; }
    [[nodiscard]] int bodies() const noexcept { return static_cast<int>(born_.size()); }  ///< with later ones
    /// Step at whose end the body first exists; the next step is the first it takes part in.
    [[nodiscard]] std::uint64_t born(int body) const { return born_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] bool moves(int body) const { return moves_[static_cast<std::size_t>(body)] != 0; }
    /// Number of moving bodies that exist at the end of step `step`.
    [[nodiscard]] int moving(std::uint64_t step) const;
    [[nodiscard]] bool moves_at(int body, std::uint64_t step) const;

private:
    WorldScene scene_;
    std::size_t next_ = 0;
    double busy_until_s_ = 0;
    bool busy_ = true;  // a step that was applied begins before that
    int first_later_ = 0, moving_at_first_ = 0;
    std::vector<std::uint64_t> born_;
    std::vector<std::uint8_t> moves_;
};

/// A copy of a world in lockstep. Exact records of its bodies come from other workers or from its own steps.
/// It is whole when it has every moving body's record of its step.
class Replica {
public:
    explicit Replica(const WorldScene& scene);  ///< at the start

    [[nodiscard]] World& world() noexcept { return world_; }  ///< the copy
    [[nodiscard]] const World& world() const noexcept { return world_; }
    [[nodiscard]] const SceneClock& clock() const noexcept { return clock_; }
    [[nodiscard]] std::uint64_t step() const noexcept { return step_; }  ///< that the copy is at
    [[nodiscard]] bool whole() const noexcept { return whole_; }         ///< see above

    /// Stores what was published of step `step`. The first record of a body counts.
    void note(std::uint64_t step, std::vector<WorldRecord>&& bodies, std::vector<ContactRecord>&& contacts,
              std::vector<SpringRecord>&& springs);
    /// Becomes whole if every record of its step has arrived. If it is whole, `along` is set and every
    /// record of the next step has arrived, it goes there by copying. Returns whether anything changed.
    bool advance(bool along);
    /// Applies the events before a step.
    void begin() { begin_at(step_); }
    void begin_at(std::uint64_t step);
    /// After a step of the world: marks the records of own bodies as present. complete: the copy has all bodies as they are, so
    /// that of what others publish it has to know no more than that they did.
    void stepped(std::span<const std::uint8_t> own, bool complete);
    [[nodiscard]] bool complete() const noexcept { return complete_; }
    /// These bodies' records of the step that a complete copy is at were published.
    void mark(std::span<const std::uint32_t> bodies);
    /// Goes back to the snapshot taken before the step that stepped() ended. What was published of that step
    /// stays known: the bodies `own`, these springs, and the world's contacts.
    void undo(const WorldSnapshot& before, std::span<const std::uint8_t> own,
              const std::vector<SpringRecord>& springs);
    /// Goes to the end of a later step by its snapshot.
    void jump(const WorldSnapshot& snapshot);

private:
    struct Known {
        std::vector<std::uint8_t> body;  // whether its record is there
        int moving = 0;                  // how many of them move and are there
        std::vector<WorldRecord> bodies;
        std::vector<ContactRecord> contacts;
        std::vector<SpringRecord> springs;
    };
    Known& at(std::uint64_t step);
    void mark(Known& known, std::uint64_t step, int body) const;
    [[nodiscard]] bool all_known(std::uint64_t step) const;
    void sort_contacts(Known& known) const;

    World world_;
    SceneClock clock_;
    std::uint64_t step_ = 0;
    bool whole_ = true, complete_ = false;
    std::map<std::uint64_t, Known> known_;  // of this step and later ones
};

}  // namespace sim
