#include "shared/world_view.h"

#include <algorithm>

namespace sim {

WorldView::WorldView(const WorldScene& scene, Pace pace) : pace_(pace), replica_(scene) {
    published_.resize(static_cast<std::size_t>(replica_.clock().bodies()));
    still_.resize(published_.size(), 0), released_.resize(published_.size(), 0);
}

void WorldView::take(std::uint64_t step, StateMessage&& message) {
    replica_.note(step, std::move(message));
}

void WorldView::take(std::uint64_t step, const std::vector<Update>& updates) {
    for (const Update& update : updates) {
        WorldRecord record;
        record.body = static_cast<int>(update.body);
        record.state = update.state;
        record.asleep = update.asleep, record.quarantined = update.quarantined;
        keep(record.body, {step, record, update.asleep || update.still});
    }
}

void WorldView::take(std::uint64_t step, const std::vector<WorldRecord>& records) {
    if (pace_ == Pace::lockstep) return;
    for (const WorldRecord& record : records) keep(record.body, {step, record, record.asleep});
}

void WorldView::keep(int body, Published&& published) {
    auto& all = published_[static_cast<std::size_t>(body)];
    if (published.step <= step_) return;
    const auto at = std::lower_bound(all.begin(), all.end(), published.step,
                                     [](const Published& p, std::uint64_t step) { return p.step < step; });
    if (at != all.end() && at->step == published.step) return;
    all.insert(at, std::move(published));
}

void WorldView::break_constraint(int constraint) {
    replica_.world().remove_constraint(constraint);
}

void WorldView::jump(const WorldSnapshot& snapshot) {
    replica_.jump(snapshot);
    step_ = snapshot.step;
}

bool WorldView::advance() {
    if (pace_ == Pace::bounded) return advance_bounded();
    if (!replica_.advance(true)) return false;
    step_ = replica_.step();
    return true;
}

bool WorldView::advance_bounded() {
    const std::uint64_t next = step_ + 1;
    for (int i = 0; i < clock().bodies(); ++i) {
        const auto& all = published_[static_cast<std::size_t>(i)];
        if (released_[static_cast<std::size_t>(i)] == 0 && clock().moves_at(i, next) &&
            (all.empty() || all.back().step < next))
            return false;
    }
    replica_.begin_at(step_);
    for (int i = 0; i < replica_.world().bodies(); ++i)
        if (clock().moves(i)) show(i, next);
    step_ = next;
    replica_.world().set_step(step_);
    return true;
}

void WorldView::show(int body, std::uint64_t step) {
    auto& all = published_[static_cast<std::size_t>(body)];
    World& world = replica_.world();
    if (!all.empty() && all.front().step == step) {
        world.restore(all.front().record);
        still_[static_cast<std::size_t>(body)] = all.front().still;
        all.pop_front();
        return;
    }
    WorldRecord record = world.record(body);
    if (record.asleep || record.quarantined) return;
    world.extrapolate(body, record.state, nullptr);
    world.restore(record);
}

bool WorldView::at_rest() const {
    const World& world = replica_.world();
    if (clock().events_left()) return false;
    if (pace_ == Pace::lockstep) return world.all_asleep();
    for (int i = 0; i < world.bodies(); ++i) {
        const WorldRecord record = world.record(i);
        const bool rests = record.asleep || record.quarantined || still_[static_cast<std::size_t>(i)] != 0;
        if (clock().moves(i) && !rests) return false;
    }
    return true;
}

}  // namespace sim
