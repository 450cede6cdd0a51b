#pragma once
#include <map>
#include <span>
#include <vector>

#include "messages/world_messages.h"

namespace sim {

/// Where in its future a scene's world is: applies events, knows when each body comes.
class SceneClock {
public:
    explicit SceneClock(const WorldScene& scene);

    /// Events before step `step` + 1 that have not been applied yet: constraints go, bodies come.
    void apply(World& world, std::uint64_t step);
    [[nodiscard]] bool events_left() const noexcept { return next_ < scene_.events.size(); }
    [[nodiscard]] int bodies() const noexcept { return static_cast<int>(born_.size()); }  ///< and to come
    /// Step at whose end the body is first known; its first step is the next one.
    [[nodiscard]] std::uint64_t born(int body) const { return born_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] bool moves(int body) const { return moves_[static_cast<std::size_t>(body)] != 0; }
    /// Bodies that move and are there at the end of step `step`.
    [[nodiscard]] int moving(std::uint64_t step) const;
    [[nodiscard]] bool moves_at(int body, std::uint64_t step) const;

private:
    WorldScene scene_;
    std::size_t next_ = 0;
    int first_later_ = 0, moving_at_first_ = 0;
    std::vector<std::uint64_t> born_;
    std::vector<std::uint8_t> moves_;
};

/// A copy of a world in lockstep, whose bodies' exact records come from outside or from steps of its own. It
/// is whole when every moving body's record at its step is there.
class Replica {
public:
    explicit Replica(const WorldScene& scene);

    [[nodiscard]] World& world() noexcept { return world_; }
    [[nodiscard]] const World& world() const noexcept { return world_; }
    [[nodiscard]] const SceneClock& clock() const noexcept { return clock_; }
    [[nodiscard]] std::uint64_t step() const noexcept { return step_; }
    [[nodiscard]] bool whole() const noexcept { return whole_; }

    /// What was published of step `step`. The first record of a body counts.
    void note(std::uint64_t step, std::vector<WorldRecord>&& bodies, std::vector<ContactRecord>&& contacts,
              std::vector<SpringRecord>&& springs);
    /// All known of the world's step: it becomes whole. All known of the next (and the world whole): goes
    /// there without a step of its own, when `along`. Returns whether anything changed.
    bool advance(bool along);
    /// Before a step of the world: events.
    void begin() { begin_at(step_); }
    void begin_at(std::uint64_t step) { clock_.apply(world_, step); }
    /// After a step of the world: the records of own bodies are there.
    void stepped(std::span<const std::uint8_t> own);
    /// Back to the snapshot that was taken before the step that stepped() ended. What was published of it
    /// stays known: the bodies `own`, these springs, and whatever contacts the world has.
    void undo(const WorldSnapshot& before, std::span<const std::uint8_t> own,
              const std::vector<SpringRecord>& springs);
    /// Everything at the end of a later step.
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
    bool whole_ = true;
    std::map<std::uint64_t, Known> known_;  // of this step and later ones
};

}  // namespace sim
