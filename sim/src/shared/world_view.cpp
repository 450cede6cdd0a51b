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

void assign(WorldRecord& record, const Update& update) {
    record.body = static_cast<int>(update.body);
    record.state = update.state;
    record.asleep = update.asleep, record.quarantined = update.quarantined;
    record.at_limit = false, record.still_steps = 0, record.sleep_group = -1;
}

void WorldView::take(std::uint64_t step, const std::vector<Update>& updates) {
    for (const Update& update : updates)
        if (Published* place = place_for(static_cast<int>(update.body), step)) {
            assign(place->record, update);
            place->still = update.asleep || update.still;
        }
}

void WorldView::take(std::uint64_t step, const std::vector<WorldRecord>& records, bool last) {
    if (pace_ == Pace::lockstep) return;
    for (const WorldRecord& record : records)
        if (Published* place = place_for(record.body, step, last)) {
            place->record = record;
            place->still = is_still(record, world().settings().dt);
        }
}

// nullptr: it is there, or will not be shown.
WorldView::Published* WorldView::place_for(int body, std::uint64_t step, bool again) {
    auto& all = published_[static_cast<std::size_t>(body)];
    if (step <= step_ || !clock().there_at(body, step)) return nullptr;
    const auto at = std::ranges::lower_bound(all, step, {}, &Published::step);
    if (at != all.end() && (*at)->step == step) return again ? *at : nullptr;
    if (spare_.empty()) spare_.push_back(&places_.emplace_back());
    Published* place = spare_.back();
    spare_.pop_back();
    place->step = step;
    all.insert(at, place);
    return place;
}

void WorldView::break_constraint(int constraint) {
    replica_.world().remove_constraint(constraint);
}

void WorldView::jump(const WorldSnapshot& snapshot) {
    replica_.jump(snapshot);
    step_ = snapshot.step;
}

bool WorldView::advance() {
    if (pace_ == Pace::bounded ? !advance_bounded() : !replica_.advance(true)) return false;
    if (pace_ == Pace::lockstep) step_ = replica_.step();
    events_now_ = false;
    return true;
}

bool WorldView::advance_bounded() {
    const std::uint64_t next = step_ + 1;
    for (int i = 0; i < clock().bodies(); ++i) {
        const auto& all = published_[static_cast<std::size_t>(i)];
        if (released_[static_cast<std::size_t>(i)] == 0 && clock().moves_at(i, next) &&
            (all.empty() || all.back()->step < next))
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
    if (!all.empty() && all.front()->step == step) {
        world.restore(all.front()->record);
        still_[static_cast<std::size_t>(body)] = all.front()->still;
        spare_.push_back(all.front());
        all.erase(all.begin());
        return;
    }
    world.record(body, record_);
    if (record_.asleep || record_.quarantined) return;
    world.extrapolate(body, record_.state, nullptr);
    world.restore(record_);
}

WorldSnapshot WorldView::snapshot() const {
    WorldSnapshot snapshot = world().snapshot();
    std::erase_if(snapshot.bodies, [this](const WorldRecord& r) { return !clock().there_at(r.body, step_); });
    return snapshot;
}

bool WorldView::at_rest() const {
    const World& world = replica_.world();
    if (clock().events_left()) return false;
    if (pace_ == Pace::lockstep) return world.all_asleep();
    if (events_now_) return false;
    for (int i = 0; i < world.bodies(); ++i) {
        const bool rests = world.asleep(i) || still_[static_cast<std::size_t>(i)] != 0;
        if (clock().moves(i) && !rests && !world.record(i).quarantined) return false;
    }
    return true;
}

}  // namespace sim
