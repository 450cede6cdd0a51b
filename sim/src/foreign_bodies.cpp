#include "foreign_bodies.h"

#include <algorithm>
#include <utility>

namespace sim {

ForeignBodies::ForeignBodies(World& world, const PushLog& pushes, std::uint32_t self, int bodies)
    : world_(&world),
      pushes_(&pushes),
      self_(self),
      dt_(world.settings().dt),
      gravity_(world.settings().gravity.norm()),
      seen_(static_cast<std::size_t>(bodies)) {}

void ForeignBodies::take(std::uint64_t step, std::shared_ptr<const UpdateMessage> message) {
    for (const Update& update : message->bodies) {
        const int body = static_cast<int>(update.body);
        if (body >= world_->bodies()) continue;  // comes later here
        auto& seen = seen_[update.body];
        while (!seen.empty() && seen.back().step >= step) seen.pop_back();
        seen.push_back({step, message, &update, world_->ball_radius(body, update.state.q)});
    }
}

void ForeignBodies::take_own(int body, std::uint64_t step, std::vector<std::uint32_t> sources,
                             std::vector<std::uint64_t> applied) {
    auto message = std::make_shared<UpdateMessage>();
    const WorldRecord record = world_->record(body);
    Update& update = message->bodies.emplace_back();
    update.body = static_cast<std::uint32_t>(body);
    update.asleep = record.asleep, update.quarantined = record.quarantined;
    update.state = record.state;
    message->sources = std::move(sources), message->applied = std::move(applied);
    seen_[static_cast<std::size_t>(body)].clear();
    take(step, std::move(message));
}

const ForeignBodies::Seen& ForeignBodies::seen_at(int body, std::uint64_t now) const {
    const auto& seen = seen_[static_cast<std::size_t>(body)];
    for (auto it = seen.rbegin(); it != seen.rend(); ++it)
        if (it->step <= now) return *it;
    return seen.front();
}

std::uint64_t ForeignBodies::applied(const Seen& seen, std::uint32_t source) {
    const auto& sources = seen.message->sources;
    const auto found = std::find(sources.begin(), sources.end(), source);
    return found == sources.end() ? 0
                                  : seen.message->applied[static_cast<std::size_t>(found - sources.begin())];
}

void ForeignBodies::put_right(int body, const Seen& seen, WorldBodyState& state) {
    for (const std::uint32_t source : pushes_->sources_of(body)) {
        const std::uint64_t then = applied(seen, source), now = pushes_->known(source);
        if (now <= then || then >= seen.step) continue;
        for (std::uint64_t step = pushes_->first_kept(then + 1, seen.step); step <= seen.step; ++step) {
            const StepImpulse right = pushes_->seen(body, source, step, now);
            const StepImpulse wrong = negative(pushes_->seen(body, source, step, then));
            if (!is_zero(right)) world_->correct(body, state, right, static_cast<int>(seen.step - step));
            if (!is_zero(wrong)) world_->correct(body, state, wrong, static_cast<int>(seen.step - step));
        }
    }
}

ForeignBodies::Ghost ForeignBodies::at(int body, std::uint64_t now) {
    const Seen& seen = seen_at(body, now);
    Ghost ghost;
    ghost.state = seen.update->state;
    const std::vector<std::uint32_t> sources = pushes_->sources_of(body);
    ghost.asleep = seen.update->asleep && sources.empty();
    if (ghost.asleep || seen.update->quarantined) return ghost;
    ghost.leant_on = seen.update->held;
    ghost.age = now > seen.step ? static_cast<int>(now - seen.step) : 0;
    put_right(body, seen, ghost.state);
    for (std::uint64_t step = seen.step + 1; step <= now + 1; ++step) {
        StepImpulse held;
        if (seen.update->held) held = seen.update->impulse;
        for (const std::uint32_t source : sources) {
            if (step > now && source == self_) continue;
            add_impulse(held, pushes_->seen(body, source, step, pushes_->known(source)));
        }
        if (step > now) {
            ghost.held = std::move(held);
            break;
        }
        world_->extrapolate(body, ghost.state, &held);
    }
    return ghost;
}

ForeignBall ForeignBodies::ball(int body, std::uint64_t now) {
    auto& all = seen_[static_cast<std::size_t>(body)];
    while (all.size() > 1 && all[1].step <= now) all.pop_front();
    const Seen& seen = all.front();
    const WorldBodyState& s = seen.update->state;
    const double age =
        seen.update->asleep ? 0 : (static_cast<double>(now) - static_cast<double>(seen.step)) * dt_;
    const double speed = s.velocity.norm(), fall = gravity_ * (std::abs(age) + dt_);
    return {body, s.position + age * s.velocity,
            1.02 * seen.radius + dt_ * (speed + fall) + fall * std::abs(age)};
}

bool ForeignBodies::quarantined(int body) const {
    return seen_[static_cast<std::size_t>(body)].back().update->quarantined;
}

Eigen::Vector3d ForeignBodies::last_position(int body) const {
    return seen_[static_cast<std::size_t>(body)].back().update->state.position;
}

}  // namespace sim
