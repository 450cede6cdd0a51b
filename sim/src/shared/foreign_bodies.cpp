#include "shared/foreign_bodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {
namespace {

// Moves a body on with constant velocities.
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

std::pair<int, int> bodies_of(const CrossImpulse& c) {
    return {c.own, c.ghost};
}

const CrossImpulse* find_pair(const std::vector<CrossImpulse>& crossed, int own, int ghost) {
    const auto found = std::ranges::lower_bound(crossed, std::pair(own, ghost), {}, bodies_of);
    return found == crossed.end() || bodies_of(*found) != std::pair(own, ghost) ? nullptr : &*found;
}

ForeignBodies::ForeignBodies(SharedWorld& world, std::uint32_t self, int bodies, int keep_steps)
    : world_(&world),
      self_(self),
      dt_(world.settings().dt),
      gravity_(world.settings().gravity.norm()),
      keep_(static_cast<std::size_t>(keep_steps)),
      latest_(static_cast<std::size_t>(bodies)) {}

// nullptr: the step is too old to be kept.
ForeignBodies::ReceivedStep* ForeignBodies::slot(std::uint32_t worker, std::uint64_t step) {
    std::vector<ReceivedStep>& slots = received_[worker];
    slots.resize(keep_);
    ReceivedStep& slot = slots[step % keep_];
    if (slot.step > step) return nullptr;
    if (std::exchange(slot.step, step) != step) {
        slot.complete = false, slot.acknowledged = 0;
        slot.bodies.clear(), slot.crossed.clear();
    }
    return &slot;
}

const ForeignBodies::ReceivedStep* ForeignBodies::received(std::uint32_t worker, std::uint64_t step) const {
    const auto found = received_.find(worker);
    if (found == received_.end()) return nullptr;
    const ReceivedStep& slot = found->second[step % keep_];
    return slot.step == step ? &slot : nullptr;
}

void ForeignBodies::keep_own(std::uint64_t step, const std::vector<CrossImpulse>& crossed) {
    if (ReceivedStep* own = slot(self_, step)) own->crossed = crossed, own->complete = true;
}

void ForeignBodies::expect_nothing_until(std::uint32_t worker, std::uint64_t step) {
    for (std::uint64_t t = step > keep_ ? step - keep_ : 0; ++t <= step;)
        if (ReceivedStep* received = slot(worker, t)) received->complete = true;
}

void ForeignBodies::add_found(std::uint32_t worker, const FoundStep& found) {
    ReceivedStep* received = slot(worker, found.step);
    if (!received) return;
    for (const CrossImpulse& c : found.crossed) {
        const auto at = std::ranges::lower_bound(received->crossed, bodies_of(c), {}, bodies_of);
        if (at == received->crossed.end() || bodies_of(*at) != bodies_of(c)) received->crossed.insert(at, c);
    }
}

std::vector<FoundStep> ForeignBodies::found_at(const std::vector<int>& bodies) const {
    std::vector<FoundStep> found;
    const auto slots = received_.find(self_);
    if (slots == received_.end()) return found;
    const auto is_one = [&](int body) { return std::ranges::binary_search(bodies, body); };
    for (const ReceivedStep& own : slots->second) {
        FoundStep step{own.step, {}};
        std::ranges::copy_if(own.crossed, std::back_inserter(step.crossed),
                             [&](const CrossImpulse& c) { return is_one(c.ghost) || is_one(c.own); });
        if (!step.crossed.empty()) found.push_back(std::move(step));
    }
    return found;
}

void ForeignBodies::receive(std::uint32_t worker, std::uint64_t step, NeighbourMessage&& message,
                            const std::vector<std::uint32_t>& owner) {
    ReceivedStep* received = slot(worker, step);
    if (!received) return;
    add_found(worker, {step, std::move(message.crossed)});
    received->complete = true, received->acknowledged = message.acknowledged;
    const std::vector<PackedUpdates::Place>& bodies = message.bodies.places();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const PackedUpdates::Place& place = bodies[i];
        if (owner[place.body] != worker) continue;
        const auto body = static_cast<int>(place.body);
        set_latest(body, step, worker, {place.position, place.velocity, place.asleep, place.quarantined}, i);
        // The state of a sleeping body is sent once, so it is kept for longer than the message.
        if (!place.asleep) continue;
        KnownState& state = registered_[body];
        state.step = step;
        message.bodies.read(place, state.update);
    }
    for (const NeighbourMessage::Place& place : message.places)
        if (Latest& latest = latest_[place.body];
            owner[place.body] == worker && latest.step < step && !latest.pose.asleep)
            latest.pose.position = place.position.cast<double>();
    received->bodies = std::move(message.bodies);
}

void ForeignBodies::add_body(const WorldRecord& record, std::uint64_t step) {
    if (!known(record.body)) return set(record, step);
    const auto [entry, is_new] = registered_.try_emplace(record.body);
    if (!is_new) return;
    entry->second.step = step;
    entry->second.update.body = static_cast<std::uint32_t>(record.body);
    entry->second.update.state = record.state;
}

void ForeignBodies::set(const WorldRecord& record, std::uint64_t step) {
    KnownState& state = registered_[record.body];
    state.step = step;
    Update& update = state.update;
    update.body = static_cast<std::uint32_t>(record.body);
    update.asleep = record.asleep, update.quarantined = record.quarantined;
    update.still = update.held = false;
    update.state = record.state;
    update.impulse.set_zero();
    set_latest(record.body, step, kApplication,
               {record.state.position, record.state.velocity, record.asleep, record.quarantined}, 0);
}

void ForeignBodies::set_latest(int body, std::uint64_t step, std::uint32_t worker, const Pose& pose,
                               std::size_t index) {
    Latest& latest = this->latest(body);
    if (worker != kApplication && step < latest.step) return;  // it is from a former owner
    const bool other = latest.worker != kApplication && latest.worker != worker;
    latest = {step,
              worker,
              true,
              pose,
              index,
              other ? latest.worker : latest.worker_before,
              other ? latest.step : latest.step_before};
}

// Goes through a worker's messages of consecutive steps backwards from step `from`. Returns the first message
// that is not later than `now`, or else the earliest.
ForeignBodies::Found ForeignBodies::last_until(int body, std::uint32_t worker, std::uint64_t from,
                                               std::uint64_t now, std::size_t index) const {
    Found best;
    const auto slots = received_.find(worker);
    for (std::uint64_t step = from, left = keep_; slots != received_.end() && left > 0; --left, --step) {
        const ReceivedStep& slot = slots->second[step % keep_];
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

// Whether a registered state is nearer to `now` than a message of a step. A body that was registered asleep
// sleeps until a message says otherwise.
bool ForeignBodies::is_nearer(const KnownState& registered, std::uint64_t step, std::uint64_t now) {
    if (registered.step > now) return false;
    return step <= now ? registered.step > step
                       : registered.update.asleep || now - registered.step <= step - now;
}

// Sets base_. If the body was sold after `now`, the states that its former owner sent are the nearer ones.
void ForeignBodies::find_base(int body, std::uint64_t now) {
    const Latest& latest = this->latest(body);
    Found best = last_until(body, latest.worker, latest.step, now, latest.index);
    const auto state = registered_.find(body);
    const bool registered = state != registered_.end();
    if ((!best.message || best.message->step > now) && !(registered && state->second.step <= now)) {
        const Found before = last_until(body, latest.worker_before, latest.step_before, now, 0);
        if (before.message && (!best.message || before.message->step < best.message->step)) best = before;
    }
    if (!best.message || (registered && is_nearer(state->second, best.message->step, now))) {
        base_ = registered_.at(body);  // every known body was registered at first
    } else {
        base_.step = best.message->step, base_.acknowledged = best.message->acknowledged;
        base_.worker = best.worker;
        best.message->bodies.read(best.message->bodies.places()[best.index], base_.update);
    }
}

const ForeignBodies::Ghost& ForeignBodies::at(int body, std::uint64_t now) {
    find_base(body, now);
    extrapolate(body, now);
    return ghost_;
}

// The owner corrects a body by rebounds that this worker found (SharedContacts), but only once it has
// received them. The state base_ lacks the corrections for steps that its sender had not received by then;
// they are added here. A correction is due where either side found a rebound and this worker owns the body
// with the lower number.
void ForeignBodies::add_rebounds_unknown_to_owner(int body) {
    const auto slots = received_.find(base_.worker);
    if (slots == received_.end()) return;
    const auto rebounds = [](const CrossImpulse* c) { return c && c->rebound; };
    for (std::uint64_t step = base_.step, left = keep_; step > base_.acknowledged && left > 0;
         --step, --left) {
        const ReceivedStep& theirs = slots->second[step % keep_];
        if (theirs.step != step) return;
        const ReceivedStep* own = received(self_, step);
        if (!own) continue;
        StepImpulse correction;
        const auto add = [&](const CrossImpulse* found_here, const CrossImpulse* found_there) {
            if (!rebounds(found_here) && !rebounds(found_there)) return;
            if (found_here)
                correction.linear -= found_here->linear, correction.angular += found_here->angular_ghost;
            if (found_there)
                correction.linear -= found_there->linear, correction.angular -= found_there->angular_own;
        };
        for (const CrossImpulse& c : own->crossed)
            if (c.ghost == body && c.own < body) add(&c, find_pair(theirs.crossed, body, c.own));
        for (const CrossImpulse& c : theirs.crossed)
            if (c.own == body && c.ghost < body && !find_pair(own->crossed, c.ghost, body)) add(nullptr, &c);
        if (correction.is_zero()) continue;
        WorldBodyState& state = ghost_.state;
        const Eigen::Vector3d velocity = correction.linear / world_->rigid_mass(body).mass;
        state.velocity += velocity, state.angular_momentum += correction.angular;
        state.position += dt_ * static_cast<double>(base_.step - step) * velocity;
    }
}

void ForeignBodies::extrapolate(int body, std::uint64_t now) {
    Ghost& ghost = ghost_;
    const Update& base = base_.update;
    ghost.state = base.state, ghost.held = base.impulse;
    ghost.age = 0;
    // A sleeping body stays where it is until something touches it. Then its owner sends its state.
    ghost.asleep = base.asleep;
    if (ghost.asleep || base.quarantined) return;
    ghost.age = now > base_.step ? static_cast<int>(now - base_.step) : 0;
    add_rebounds_unknown_to_owner(body);
    StepImpulse& held = ghost.held;
    for (std::uint64_t step = base_.step + 1; step <= now; ++step) {
        // The forces on a body that is held balance better than they are known here, so it keeps its
        // velocity.
        if (base.held) {
            coast(ghost.state, world_->rigid_mass(body).inertia, dt_);
            continue;
        }
        const Eigen::Vector3d linear = held.linear, angular = held.angular;
        if (const ReceivedStep* own = received(self_, step))
            for (const CrossImpulse& c : own->crossed)
                if (c.ghost == body) held.linear -= c.linear, held.angular += c.angular_ghost;
        world_->extrapolate(body, ghost.state, &held);
        held.linear = linear, held.angular = angular;
    }
}

ForeignBall ForeignBodies::ball(int body, std::uint64_t now) {
    for (int next = static_cast<int>(radius_.size()); next < world_->bodies(); ++next)
        radius_.push_back(1.02 * world_->most_radius(next));
    const Latest& latest = this->latest(body);
    const Pose& pose = latest.pose;
    const double age = pose.asleep ? 0 : (static_cast<double>(now) - static_cast<double>(latest.step)) * dt_;
    const double speed = pose.velocity.norm(), fall = gravity_ * (std::abs(age) + dt_);
    return {body, pose.position + age * pose.velocity,
            radius_[static_cast<std::size_t>(body)] + dt_ * (speed + fall) + fall * std::abs(age)};
}

}  // namespace sim
