#pragma once
#include <map>
#include <span>
#include <vector>

#include "messages/worker_messages.h"

namespace sim {

/// A scene's schedule: applies its events and knows at which step each body is added.
class SceneClock {
public:
    explicit SceneClock(const WorldScene& scene);  ///< at the start

    /// Applies the events due before step `step` + 1: removes constraints that still hold, adds bodies. Whether there were any.
    bool apply(World& world, std::uint64_t step);
    /// Events, or forces and prescribed motions that have not ended.
    [[nodiscard]] bool events_left() const noexcept { return next_ < scene_.events.size() || busy_; }
    [[nodiscard]] int bodies() const noexcept { return static_cast<int>(born_.size()); }  ///< with later ones
    /// Step at whose end the body first exists; the next step is the first it takes part in.
    [[nodiscard]] std::uint64_t born(int body) const { return born_[static_cast<std::size_t>(body)]; }
    [[nodiscard]] bool moves(int body) const { return moves_[static_cast<std::size_t>(body)] != 0; }
    /// Number of moving bodies that exist at the end of step `step`.
    [[nodiscard]] int moving(std::uint64_t step) const;
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
    int first_later_ = 0, moving_at_first_ = 0;
    std::vector<std::uint64_t> born_;
    std::vector<std::uint8_t> moves_;
};

/// Whether it has slept, or been slow, for half a second, in steps of dt [s].
[[nodiscard]] bool is_still(const WorldRecord& record, double dt) noexcept;

/// A copy of a world in lockstep, exact at its step: by its own steps, or of the records that others publish. It is whole when
/// every moving body was published at its step, so that all others are there, too.
class Replica {
public:
    explicit Replica(const WorldScene& scene);  ///< at the start

    [[nodiscard]] World& world() noexcept { return world_; }  ///< the copy
    [[nodiscard]] const World& world() const noexcept { return world_; }
    [[nodiscard]] const SceneClock& clock() const noexcept { return clock_; }
    [[nodiscard]] std::uint64_t step() const noexcept { return step_; }  ///< that the copy is at
    [[nodiscard]] bool whole() const noexcept { return whole_; }         ///< see above

    /// Stores what was published of step `step`. The first record of a body counts.
    void note(std::uint64_t step, StateMessage&& states);
    /// These bodies were published at a step, or own ones will be.
    void mark(std::uint64_t step, std::span<const std::uint32_t> bodies);
    /// Becomes whole if every body of its step was published. If it is whole, `along` is set and every
    /// record of the next step has arrived, it goes there by copying. Returns whether anything changed.
    bool advance(bool along);
    /// Whether bodies of the next step are known to be published, whose records have not come and will not.
    [[nodiscard]] bool misses_records() const;
    /// Applies the events before a step; whether there were any.
    bool begin() { return begin_at(step_); }
    bool begin_at(std::uint64_t step);
    void stepped();  ///< after a step of the world
    /// Goes to the end of a later step by its snapshot.
    void jump(const WorldSnapshot& snapshot);

private:
    enum : std::uint8_t { kUnknown, kPublished, kRecorded };
    struct Known {
        std::vector<std::uint8_t> body;   // which of these
        int published = 0, recorded = 0;  // of the moving ones
        WorldSnapshot records;
    };
    Known& at(std::uint64_t step);
    void mark(Known& known, std::uint64_t step, int body) const;
    [[nodiscard]] const Known* find(std::uint64_t step) const;
    static void sort_contacts(std::vector<ContactRecord>& contacts);

    World world_;
    SceneClock clock_;
    std::uint64_t step_ = 0;
    bool whole_ = true;
    std::map<std::uint64_t, Known> known_;  // of this step and later ones
};

}  // namespace sim
