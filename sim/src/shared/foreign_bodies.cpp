#include "shared/foreign_bodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {
namespace {

// On with the same velocity.
void coast(WorldBodyState& s, const Eigen::Vector3d& inertia, double time) {
    const Eigen::Vector3d turn =
        time * (s.orientation * (s.orientation.conjugate() * s.angular_momentum).cwiseQuotient(inertia));
    s.position += time * s.velocity;
    const double angle = turn.norm();
    if (angle > 1e-12)
        s.orientation =
            (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * s.orientation).normalized();
}

}  // namespace

ForeignBodies::ForeignBodies(SharedWorld& world, std::uint32_t self, int bodies, int keep_steps)
    : world_(&world),
      self_(self),
      dt_(world.settings().dt),
      gravity_(world.settings().gravity.norm()),
      keep_(static_cast<std::size_t>(keep_steps)),
      newest_(static_cast<std::size_t>(bodies)) {}

// nullptr: it is too old.
ForeignBodies::Heard* ForeignBodies::slot(std::uint32_t worker, std::uint64_t step) {
    std::vector<Heard>& slots = heard_[worker];
    slots.resize(keep_);
    Heard& slot = slots[step % keep_];
    if (slot.step > step) return nullptr;
    if (std::exchange(slot.step, step) != step) {
        slot.there = false, slot.heard = 0;
        slot.bodies.clear(), slot.crossed.clear();
    }
    return &slot;
}

const ForeignBodies::Heard* ForeignBodies::heard(std::uint32_t worker, std::uint64_t step) const {
    const auto found = heard_.find(worker);
    if (found == heard_.end()) return nullptr;
    const Heard& slot = found->second[step % keep_];
    return slot.step == step ? &slot : nullptr;
}

void ForeignBodies::keep_own(std::uint64_t step, const std::vector<CrossImpulse>& crossed) {
    if (Heard* own = slot(self_, step)) own->crossed = crossed, own->there = true;
}

void ForeignBodies::nothing_until(std::uint32_t worker, std::uint64_t step) {
    for (std::uint64_t t = step > keep_ ? step - keep_ : 0; ++t <= step;)
        if (Heard* heard = slot(worker, t)) heard->there = true;
}

void ForeignBodies::add(std::uint32_t worker, const FoundStep& found) {
    Heard* heard = slot(worker, found.step);
    if (!heard) return;
    const auto pair_of = [](const CrossImpulse& c) { return std::pair(c.own, c.ghost); };
    for (const CrossImpulse& c : found.crossed) {
        const auto at = std::ranges::lower_bound(heard->crossed, pair_of(c), {}, pair_of);
        if (at == heard->crossed.end() || pair_of(*at) != pair_of(c)) heard->crossed.insert(at, c);
    }
}

std::vector<FoundStep> ForeignBodies::found_at(const std::vector<int>& bodies) const {
    std::vector<FoundStep> found;
    const auto slots = heard_.find(self_);
    if (slots == heard_.end()) return found;
    for (const Heard& heard : slots->second) {
        FoundStep step{heard.step, {}};
        std::ranges::copy_if(heard.crossed, std::back_inserter(step.crossed), [&](const CrossImpulse& c) {
            return std::ranges::binary_search(bodies, c.ghost) || std::ranges::binary_search(bodies, c.own);
        });
        if (!step.crossed.empty()) found.push_back(std::move(step));
    }
    return found;
}

void ForeignBodies::take(std::uint32_t worker, std::uint64_t step, NeighbourMessage&& message,
                         const std::vector<std::uint32_t>& owner) {
    Heard* heard = slot(worker, step);
    if (!heard) return;
    add(worker, {step, std::move(message.crossed)});
    heard->there = true, heard->heard = message.heard;
    const std::vector<PackedUpdates::Place>& bodies = message.bodies.places();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const PackedUpdates::Place& place = bodies[i];
        if (owner[place.body] != worker) continue;
        const auto body = static_cast<int>(place.body);
        tell(body, step, worker, {place.position, place.velocity, place.asleep, place.quarantined}, i);
        // It is not told again before it wakes.
        if (!place.asleep) continue;
        Told& rest = rest_[body];
        rest.step = step;
        message.bodies.read(place, rest.update);
    }
    for (const NeighbourMessage::Place& place : message.places)
        if (Newest& newest = newest_[place.body];
            owner[place.body] == worker && newest.step < step && !newest.glance.asleep)
            newest.glance.position = place.position.cast<double>();
    heard->bodies = std::move(message.bodies);
}

void ForeignBodies::born(const WorldRecord& record, std::uint64_t step) {
    if (!known(record.body)) return set(record, step);
    const auto [entry, fresh] = rest_.try_emplace(record.body);
    if (!fresh) return;
    entry->second.step = step;
    entry->second.update.body = static_cast<std::uint32_t>(record.body);
    entry->second.update.state = record.state;
}

void ForeignBodies::set(const WorldRecord& record, std::uint64_t step) {
    Told& told = rest_[record.body];
    told.step = step;
    Update& update = told.update;
    update.body = static_cast<std::uint32_t>(record.body);
    update.asleep = record.asleep, update.quarantined = record.quarantined;
    update.still = update.held = false;
    update.state = record.state;
    update.impulse.set_zero();
    tell(record.body, step, kApplication,
         {record.state.position, record.state.velocity, record.asleep, record.quarantined}, 0);
}

void ForeignBodies::tell(int body, std::uint64_t step, std::uint32_t worker, const Glance& glance,
                         std::size_t index) {
    Newest& newest = newest_[static_cast<std::size_t>(body)];
    if (worker != kApplication && step < newest.step) return;  // of who has sold it
    const bool other = newest.worker != kApplication && newest.worker != worker;
    newest = {step,
              worker,
              true,
              glance,
              index,
              other ? newest.worker : newest.worker_before,
              other ? newest.step : newest.step_before};
}

// Of a worker's messages from step `from` backwards without a gap the first that is not later than `now`, or the earliest.
ForeignBodies::Message ForeignBodies::last_until(int body, std::uint32_t worker, std::uint64_t from,
                                                 std::uint64_t now, std::size_t index) const {
    Message best;
    const auto slots = heard_.find(worker);
    for (std::uint64_t step = from, left = keep_; slots != heard_.end() && left > 0; --left, --step) {
        const Heard& slot = slots->second[step % keep_];
        if (slot.step != step) break;
        const std::vector<PackedUpdates::Place>& places = slot.bodies.places();
        if (index >= places.size() || places[index].body != static_cast<std::uint32_t>(body)) {
            const auto place = std::ranges::lower_bound(places, static_cast<std::uint32_t>(body), {},
                                                        &PackedUpdates::Place::body);
            if (place == places.end() || place->body != static_cast<std::uint32_t>(body)) break;
            index = static_cast<std::size_t>(place - places.begin());
        }
        best = {&slot, index, worker};
        if (step <= now || step == 0) break;
    }
    return best;
}

// Whether what was registered, or told when it fell asleep, is nearer to `now` than what was told of a step. Who slept does so until
// it is told otherwise.
bool ForeignBodies::counts(const Told& rest, std::uint64_t step, std::uint64_t now) {
    if (rest.step > now) return false;
    return step <= now ? rest.step > step : rest.update.asleep || now - rest.step <= step - now;
}

// Into told_. Of a body that was sold a worker that is behind needs what its owner before told.
void ForeignBodies::find_told(int body, std::uint64_t now) {
    const Newest& newest = newest_[static_cast<std::size_t>(body)];
    Message best = last_until(body, newest.worker, newest.step, now, newest.index);
    const auto rest = rest_.find(body);
    const bool registered = rest != rest_.end();
    if ((!best.heard || best.heard->step > now) && !(registered && rest->second.step <= now)) {
        const Message before = last_until(body, newest.worker_before, newest.step_before, now, 0);
        if (before.heard && (!best.heard || before.heard->step < best.heard->step)) best = before;
    }
    if (!best.heard || (registered && counts(rest->second, best.heard->step, now))) {
        told_ = rest_.at(body);  // who is known was registered at first
    } else {
        told_.step = best.heard->step, told_.heard = best.heard->heard, told_.worker = best.worker;
        best.heard->bodies.read(best.heard->bodies.places()[best.index], told_.update);
    }
}

const ForeignBodies::Ghost& ForeignBodies::at(int body, std::uint64_t now) {
    find_told(body, now);
    extrapolate(body, now);
    return ghost_;
}

// What rebounds of steps before the told state gave the body, and its owner did not know by then: where the own one's number is lower
// what was found here counts, instead of what was found there (SharedContacts).
void ForeignBodies::add_owed(int body) {
    const auto slots = heard_.find(told_.worker);
    if (slots == heard_.end()) return;
    const auto rebound = [](const CrossImpulse& c) { return c.rebound; };
    for (std::uint64_t step = told_.step, left = keep_; step > 0 && left > 0; --step, --left) {
        const Heard& theirs = slots->second[step % keep_];
        if (theirs.step != step || step <= told_.heard) return;  // it knew
        const Heard* own = heard(self_, step);
        if (!own ||
            (std::ranges::none_of(own->crossed, rebound) && std::ranges::none_of(theirs.crossed, rebound)))
            continue;
        StepImpulse owed;
        const auto find = [](const std::vector<CrossImpulse>& crossed, int one, int other) {
            const auto at = std::ranges::find_if(
                crossed, [&](const CrossImpulse& c) { return c.own == one && c.ghost == other; });
            return at == crossed.end() ? nullptr : &*at;
        };
        const auto owes = [&](const CrossImpulse* here, const CrossImpulse* there) {
            if (!(here && here->rebound) && !(there && there->rebound)) return;
            if (here) owed.linear -= here->linear, owed.angular += here->angular_ghost;
            if (there) owed.linear -= there->linear, owed.angular -= there->angular_own;
        };
        for (const CrossImpulse& c : own->crossed)
            if (c.ghost == body && c.own < body) owes(&c, find(theirs.crossed, body, c.own));
        for (const CrossImpulse& c : theirs.crossed)
            if (c.own == body && c.ghost < body && !find(own->crossed, c.ghost, body)) owes(nullptr, &c);
        WorldBodyState& state = ghost_.state;
        const Eigen::Vector3d velocity = owed.linear / world_->rigid_mass(body).mass;
        state.velocity += velocity, state.angular_momentum += owed.angular;
        state.position += dt_ * static_cast<double>(told_.step - step) * velocity;
    }
}

void ForeignBodies::extrapolate(int body, std::uint64_t now) {
    Ghost& ghost = ghost_;
    const Update& told = told_.update;
    ghost.state = told.state, ghost.held = told.impulse;
    ghost.age = 0;
    // Who sleeps stays where it is until it is touched: then its owner tells.
    ghost.asleep = told.asleep;
    if (ghost.asleep || told.quarantined) return;
    ghost.age = now > told_.step ? static_cast<int>(now - told_.step) : 0;
    add_owed(body);
    StepImpulse& held = ghost.held;
    for (std::uint64_t step = told_.step + 1; step <= now; ++step) {
        // What others hold goes on as it was told: the forces on it balance better than anybody knows them here.
        if (told.held) {
            coast(ghost.state, world_->rigid_mass(body).inertia, dt_);
            continue;
        }
        const Eigen::Vector3d linear = held.linear, angular = held.angular;
        if (const Heard* own = heard(self_, step))
            for (const CrossImpulse& c : own->crossed)
                if (c.ghost == body) held.linear -= c.linear, held.angular += c.angular_ghost;
        world_->extrapolate(body, ghost.state, &held);
        held.linear = linear, held.angular = angular;
    }
}

ForeignBall ForeignBodies::ball(int body, std::uint64_t now) {
    for (int there = static_cast<int>(radius_.size()); there < world_->bodies(); ++there)
        radius_.push_back(1.02 * world_->most_radius(there));
    const Newest& newest = newest_[static_cast<std::size_t>(body)];
    const Glance& s = newest.glance;
    const double age = s.asleep ? 0 : (static_cast<double>(now) - static_cast<double>(newest.step)) * dt_;
    const double speed = s.velocity.norm(), fall = gravity_ * (std::abs(age) + dt_);
    return {body, s.position + age * s.velocity,
            radius_[static_cast<std::size_t>(body)] + dt_ * (speed + fall) + fall * std::abs(age)};
}

}  // namespace sim
