#include "shared/ghosts.h"

#include <algorithm>
#include <utility>

namespace sim {

Ghosts::Ghosts(World& world, const ImpulseLog& pushes, std::uint32_t self, int bodies, int bound)
    : world_(&world),
      pushes_(&pushes),
      self_(self),
      dt_(world.settings().dt),
      gravity_(world.settings().gravity.norm()),
      newest_(static_cast<std::size_t>(bodies)),
      seen_(static_cast<std::size_t>(bodies)),
      keep_(static_cast<std::size_t>(bound) + 3) {}

void Ghosts::take(std::uint64_t step, const std::shared_ptr<const PackedUpdates>& message) {
    for (const PackedUpdates::Place& place : message->bodies) {
        if (place.body >= seen_.size()) continue;
        auto& seen = seen_[place.body];
        while (!seen.empty() && seen.back().step >= step) seen.pop_back();
        // Nobody is further ahead of this worker than the bound.
        if (seen.size() >= keep_) seen.erase(seen.begin());
        seen.push_back({step, message, place.offset});
        newest_[place.body] = {step, true, message->glance(place.offset)};
    }
}

void Ghosts::take(std::uint64_t step, const UpdateMessage& message) {
    DecodedWorldMessage packed = decode_for_worker(encode({}, message));
    take(step, std::make_shared<const PackedUpdates>(std::get<PackedUpdates>(std::move(packed.message))));
}

void Ghosts::take_own(int body, std::uint64_t step, std::vector<std::uint32_t> sources,
                      std::vector<std::uint64_t> applied) {
    UpdateMessage message;
    const WorldRecord record = world_->record(body);
    Update& update = message.bodies.emplace_back();
    update.body = static_cast<std::uint32_t>(body);
    update.asleep = record.asleep, update.quarantined = record.quarantined;
    update.state = record.state;
    message.sources = std::move(sources), message.applied = std::move(applied);
    seen_[static_cast<std::size_t>(body)].clear();
    take(step, message);
}

const Ghosts::Seen& Ghosts::seen_at(int body, std::uint64_t now) const {
    const auto& seen = seen_[static_cast<std::size_t>(body)];
    for (auto it = seen.rbegin(); it != seen.rend(); ++it)
        if (it->step <= now) return *it;
    return seen.front();
}

std::uint64_t Ghosts::applied(const Seen& seen, std::uint32_t source) {
    const auto& sources = seen.message->sources;
    const auto found = std::find(sources.begin(), sources.end(), source);
    return found == sources.end() ? 0
                                  : seen.message->applied[static_cast<std::size_t>(found - sources.begin())];
}

void Ghosts::put_right(int body, const Seen& seen, WorldBodyState& state) {
    StepImpulse scratch;
    for (const std::uint32_t source : pushes_->sources_of(body)) {
        const std::uint64_t then = applied(seen, source), now = pushes_->known(source);
        if (now <= then || then >= seen.step) continue;
        for (std::uint64_t step = pushes_->first_kept(then + 1, seen.step); step <= seen.step; ++step) {
            const int ago = static_cast<int>(seen.step - step);
            if (const StepImpulse* right = pushes_->seen(body, source, step, now, scratch))
                world_->correct(body, state, *right, ago);
            if (const StepImpulse* wrong = pushes_->seen(body, source, step, then, scratch))
                world_->correct(body, state, *wrong, ago, -1);
        }
    }
}

Ghosts::Ghost Ghosts::at(int body, std::uint64_t now) {
    const Seen& seen = seen_at(body, now);
    Ghost ghost;
    Update update = seen.message->update(seen.offset);
    ghost.state = std::move(update.state);
    const ImpulseLog::Sources sources = pushes_->sources_of(body);
    // A sleeper stays where it is until it is pushed.
    std::uint64_t since = seen.step;
    if (update.asleep) since = std::max(since, std::min(now, pushes_->first_after(body, seen.step) - 1));
    ghost.asleep = update.asleep && since >= now;
    if (ghost.asleep || update.quarantined) return ghost;
    ghost.leant_on = update.held;
    ghost.age = now > since ? static_cast<int>(now - since) : 0;
    put_right(body, seen, ghost.state);
    StepImpulse scratch;
    for (std::uint64_t step = since + 1; step <= now + 1; ++step) {
        StepImpulse held;
        if (update.held) held = update.impulse;
        for (const std::uint32_t source : sources) {
            if (step > now && source == self_) continue;
            if (const StepImpulse* push = pushes_->seen(body, source, step, pushes_->known(source), scratch))
                add_steady(held, *push);
        }
        if (step > now) {
            ghost.held = std::move(held);
            break;
        }
        world_->extrapolate(body, ghost.state, &held);
    }
    return ghost;
}

ForeignBall Ghosts::ball(int body, std::uint64_t now) const {
    const Newest& newest = newest_[static_cast<std::size_t>(body)];
    const PackedUpdates::Glance& s = newest.glance;
    const double age = s.asleep ? 0 : (static_cast<double>(now) - static_cast<double>(newest.step)) * dt_;
    const double speed = s.velocity.norm(), fall = gravity_ * (std::abs(age) + dt_);
    return {body, s.position + age * s.velocity,
            1.02 * world_->most_radius(body) + dt_ * (speed + fall) + fall * std::abs(age)};
}

bool Ghosts::quarantined(int body) const {
    return newest_[static_cast<std::size_t>(body)].glance.quarantined;
}

Eigen::Vector3d Ghosts::last_position(int body) const {
    return newest_[static_cast<std::size_t>(body)].glance.position;
}

}  // namespace sim
