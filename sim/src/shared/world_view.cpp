#include "shared/world_view.h"

#include <algorithm>

namespace sim {

WorldView::WorldView(const WorldScene& scene) : world_(scene.world), clock_(scene) {
    published_.resize(static_cast<std::size_t>(clock_.bodies()));
    still_.resize(published_.size(), 0), released_.resize(published_.size(), 0);
}

void assign(WorldRecord& record, const Update& update) {
    record.body = static_cast<int>(update.body);
    record.state = update.state;
    record.asleep = update.asleep, record.quarantined = update.quarantined;
    record.at_limit = false, record.still_steps = 0, record.sleep_group = -1;
}

void WorldView::add(std::uint64_t step, const std::vector<Update>& updates) {
    for (const Update& update : updates)
        if (Published* place = place_for(static_cast<int>(update.body), step)) {
            assign(place->record, update);
            place->still = update.asleep || update.still;
        }
}

void WorldView::add(std::uint64_t step, const std::vector<WorldRecord>& records, bool last) {
    for (const WorldRecord& record : records)
        if (Published* place = place_for(record.body, step, last)) {
            place->record = record;
            place->still = is_still(record, world_.settings().dt);
        }
}

// nullptr: the body has a state of this step, or the step is shown already.
WorldView::Published* WorldView::place_for(int body, std::uint64_t step, bool again) {
    auto& all = published_[static_cast<std::size_t>(body)];
    if (step <= step_ || !clock_.there_at(body, step)) return nullptr;
    const auto at = std::ranges::lower_bound(all, step, {}, &Published::step);
    if (at != all.end() && (*at)->step == step) return again ? *at : nullptr;
    if (spare_.empty()) spare_.push_back(&places_.emplace_back());
    Published* place = spare_.back();
    spare_.pop_back();
    place->step = step;
    all.insert(at, place);
    return place;
}

bool WorldView::advance() {
    const std::uint64_t next = step_ + 1;
    for (int i = 0; i < clock_.bodies(); ++i) {
        const auto& all = published_[static_cast<std::size_t>(i)];
        if (released_[static_cast<std::size_t>(i)] == 0 && clock_.moves_at(i, next) &&
            (all.empty() || all.back()->step < next))
            return false;
    }
    (void)clock_.apply(world_, step_);
    for (int i = 0; i < world_.bodies(); ++i)
        if (clock_.moves(i)) show(i, next);
    step_ = next;
    world_.set_step(step_);
    events_now_ = false;
    return true;
}

void WorldView::show(int body, std::uint64_t step) {
    auto& all = published_[static_cast<std::size_t>(body)];
    if (!all.empty() && all.front()->step == step) {
        world_.restore(all.front()->record);
        still_[static_cast<std::size_t>(body)] = all.front()->still;
        spare_.push_back(all.front());
        all.erase(all.begin());
        return;
    }
    world_.record(body, record_);
    if (record_.asleep || record_.quarantined) return;
    world_.extrapolate(body, record_.state, nullptr);
    world_.restore(record_);
}

bool WorldView::at_rest() const {
    if (clock_.events_left() || events_now_) return false;
    for (int i = 0; i < world_.bodies(); ++i) {
        const bool rests = world_.asleep(i) || still_[static_cast<std::size_t>(i)] != 0;
        if (clock_.moves(i) && !rests && !world_.record(i).quarantined) return false;
    }
    return true;
}

}  // namespace sim
