#pragma once
#include <deque>
#include <vector>

#include "messages/worker_messages.h"
#include "run/scene_clock.h"
#include "world/shared_world.h"

namespace sim {

/// Sets a record to an update. What updates do not contain is reset.
void assign(WorldRecord& record, const Update& update);

/// The view of all bodies, step by step, by their published states. A body that was not published at a step,
/// since it was changing owners, is extrapolated from its last state.
class WorldView {
public:
    explicit WorldView(const WorldScene& scene);

    void add(std::uint64_t step, const std::vector<Update>& updates);
    /// Adds exact records of bodies that are handed over, or of the last step. The latter replace states that
    /// were added before.
    void add(std::uint64_t step, const std::vector<WorldRecord>& records, bool last = false);
    /// No more states of this body will come.
    void release(int body) { released_[static_cast<std::size_t>(body)] = 1; }
    void break_constraint(int constraint) { world_.remove_constraint(constraint); }  ///< as its owner reports
    /// Advances by one step if all its states are known; returns whether it did.
    [[nodiscard]] bool advance();
    /// Applies the events before the next step, as one world does.
    void begin() { events_now_ = clock_.apply(world_, step_) || events_now_; }

    [[nodiscard]] const SharedWorld& world() const noexcept { return world_; }  ///< all bodies at step()
    [[nodiscard]] std::uint64_t step() const noexcept { return step_; }         ///< that is shown
    [[nodiscard]] const SceneClock& clock() const noexcept { return clock_; }
    /// Every body has been still for half a second and no event is left.
    [[nodiscard]] bool at_rest() const;

private:
    struct Published {
        std::uint64_t step = 0;
        WorldRecord record;
        bool still = false;
    };
    [[nodiscard]] Published* place_for(int body, std::uint64_t step, bool again = false);
    void show(int body, std::uint64_t step);

    SharedWorld world_;
    SceneClock clock_;
    std::uint64_t step_ = 0;
    std::vector<std::vector<Published*>> published_;  // of each body, by ascending steps
    std::deque<Published> places_;                    // of all
    std::vector<Published*> spare_;                   // places that are free
    WorldRecord record_;                              // kept for its storage
    std::vector<std::uint8_t> still_, released_;
    bool events_now_ =
        false;  // events before the next step were applied: bodies that they woke were still when published
};

}  // namespace sim
