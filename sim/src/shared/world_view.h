#pragma once
#include <deque>
#include <vector>

#include "shared/replica.h"

namespace sim {

/// The record of an update, without what updates do not tell.
void assign(WorldRecord& record, const Update& update);

/// All bodies as published, step by step: exact in lockstep. In bounded pace a body that was not published at
/// a step (it was changing owners) is extrapolated from its last state.
class WorldView {
public:
    WorldView(const WorldScene& scene, Pace pace);

    void take(std::uint64_t step, StateMessage&& message);              ///< lockstep
    void take(std::uint64_t step, const std::vector<Update>& updates);  ///< bounded
    /// Bounded: exact records, of what was handed over, or of the last step; those replace what is there.
    void take(std::uint64_t step, const std::vector<WorldRecord>& records, bool last = false);
    /// Bounded: nothing more will be published of this body.
    void release(int body) { released_[static_cast<std::size_t>(body)] = 1; }
    void break_constraint(int constraint);     ///< bounded: its owner reported the break
    void jump(const WorldSnapshot& snapshot);  ///< lockstep: to the end of a later step
    /// Advances by one step if all its states are known; returns whether it did.
    [[nodiscard]] bool advance();
    /// Applies the events before the next step, as one world does.
    void begin() { events_now_ = replica_.begin_at(step_) || events_now_; }

    [[nodiscard]] const World& world() const noexcept { return replica_.world(); }  ///< all bodies at step()
    [[nodiscard]] std::uint64_t step() const noexcept { return step_; }             ///< shown
    [[nodiscard]] const SceneClock& clock() const noexcept { return replica_.clock(); }
    /// Every body has been still for half a second and no event is left.
    [[nodiscard]] bool at_rest() const;
    [[nodiscard]] WorldSnapshot snapshot() const;  ///< without bodies that come in the next step

private:
    struct Published {
        std::uint64_t step = 0;
        WorldRecord record;
        bool still = false;
    };
    [[nodiscard]] Published* place_for(int body, std::uint64_t step, bool again = false);
    [[nodiscard]] bool advance_bounded();
    void show(int body, std::uint64_t step);

    Pace pace_;
    Replica replica_;
    std::uint64_t step_ = 0;
    std::vector<std::vector<Published*>> published_;  // bounded: of each body, by ascending steps
    std::deque<Published> places_;                    // of all
    std::vector<Published*> spare_;                   // of these
    WorldRecord record_;                              // that is being shown
    std::vector<std::uint8_t> still_, released_;
    bool events_now_ = false;  // before the next step: what they woke was still when it was published
};

}  // namespace sim
