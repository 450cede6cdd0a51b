#include "shared/replica.h"

#include <algorithm>

namespace sim {

SceneClock::SceneClock(const WorldScene& scene) {
    scene_.later = scene.later;
    scene_.events = scene.events;
    for (const TimedForce& force : scene.world.forces)
        busy_until_s_ = std::max(busy_until_s_, force.until_s + scene.world.settings.dt);
    for (const auto* bodies : {&scene.world.bodies, &scene.later})
        for (const WorldBody& body : *bodies)
            if (!body.motion.empty()) busy_until_s_ = std::max(busy_until_s_, body.motion.back().time_s);
    busy_ = busy_until_s_ > 0;
    born_.assign(scene.world.bodies.size() + scene.later.size(), 0);
    for (const WorldEvent& event : scene.events)
        for (std::size_t i = event.first; i < event.end; ++i)
            born_[scene.world.bodies.size() + i] = event.step;
    for (const WorldBody& body : scene.world.bodies) {
        moves_.push_back(body.moves());
        moving_at_first_ += body.moves();
    }
    for (const WorldBody& body : scene.later) moves_.push_back(body.moves());
    first_later_ = static_cast<int>(scene.world.bodies.size());
}

void SceneClock::apply(World& world, std::uint64_t step) {
    busy_ = static_cast<double>(step) * world.settings().dt < busy_until_s_;
    for (; next_ < scene_.events.size() && scene_.events[next_].step <= step; ++next_) {
        const WorldEvent& event = scene_.events[next_];
        for (const int constraint : event.removed)
            if (world.constraint_holds(constraint)) world.remove_constraint(constraint);
        for (std::size_t i = event.first; i < event.end; ++i) (void)world.add_body(scene_.later[i]);
    }
}

bool SceneClock::moves_at(int body, std::uint64_t step) const {
    return moves(body) && (body < first_later_ || born(body) < step);
}

int SceneClock::moving(std::uint64_t step) const {
    int count = moving_at_first_;
    for (int i = first_later_; i < bodies(); ++i) count += moves_at(i, step);
    return count;
}

Replica::Replica(const WorldScene& scene) : world_(scene.world), clock_(scene) {
    world_.share(Sharing::islands);
    for (int i = 0; i < world_.bodies(); ++i) world_.set_own(i, false);
}

void Replica::begin_at(std::uint64_t step) {
    const int before = world_.bodies();
    clock_.apply(world_, step);
    for (int i = before; i < world_.bodies(); ++i) world_.set_own(i, false);
}

Replica::Known& Replica::at(std::uint64_t step) {
    Known& known = known_[step];
    if (known.body.empty()) known.body.assign(static_cast<std::size_t>(clock_.bodies()), 0);
    return known;
}

void Replica::mark(Known& known, std::uint64_t step, int body) const {
    std::uint8_t& there = known.body[static_cast<std::size_t>(body)];
    if (there == 0 && clock_.moves_at(body, step)) ++known.moving;
    there = 1;
}

void Replica::note(std::uint64_t step, std::vector<WorldRecord>&& bodies,
                   std::vector<ContactRecord>&& contacts, std::vector<SpringRecord>&& springs) {
    if (step < step_ || (step == step_ && whole_)) return;
    Known& known = at(step);
    for (WorldRecord& record : bodies) {
        if (known.body[static_cast<std::size_t>(record.body)] != 0) continue;
        if (!clock_.moves_at(record.body, step)) continue;
        mark(known, step, record.body);
        known.bodies.push_back(std::move(record));
    }
    known.contacts.insert(known.contacts.end(), contacts.begin(), contacts.end());
    known.springs.insert(known.springs.end(), springs.begin(), springs.end());
}

bool Replica::all_known(std::uint64_t step) const {
    const auto found = known_.find(step);
    return (found == known_.end() ? 0 : found->second.moving) == clock_.moving(step);
}

void Replica::sort_contacts(Known& known) const {
    auto key = [](const ContactRecord& c) { return std::pair(c.a, c.b); };
    std::sort(known.contacts.begin(), known.contacts.end(),
              [&](const ContactRecord& a, const ContactRecord& b) { return key(a) < key(b); });
    known.contacts.erase(
        std::unique(known.contacts.begin(), known.contacts.end(),
                    [&](const ContactRecord& a, const ContactRecord& b) { return key(a) == key(b); }),
        known.contacts.end());
}

bool Replica::advance(bool along) {
    if (!whole_) {
        if (!all_known(step_)) return false;
        whole_ = true;
        if (complete_) {
            known_.erase(known_.begin(), known_.upper_bound(step_));
            return true;
        }
        Known& known = at(step_);
        sort_contacts(known);
        for (const WorldRecord& record : known.bodies) world_.restore(record);
        world_.restore_contacts(known.contacts, known.springs);
    } else {
        if (!along || !all_known(step_ + 1)) return false;
        begin();
        ++step_;
        complete_ = false;
        Known& known = at(step_);
        sort_contacts(known);
        world_.rewind({step_, std::move(known.bodies), std::move(known.contacts), std::move(known.springs),
                       world_.outside_impulse()});
    }
    whole_ = true;
    known_.erase(known_.begin(), known_.upper_bound(step_));
    return true;
}

void Replica::stepped(std::span<const std::uint8_t> own, bool complete) {
    ++step_;
    whole_ = false, complete_ = complete;
    Known& known = at(step_);
    for (int i = 0; i < world_.bodies(); ++i)
        if (own[static_cast<std::size_t>(i)] != 0) mark(known, step_, i);
}

void Replica::mark(std::span<const std::uint32_t> bodies) {
    Known& known = at(step_);
    for (const std::uint32_t body : bodies)
        if (body < known.body.size()) mark(known, step_, static_cast<int>(body));
}

void Replica::undo(const WorldSnapshot& before, std::span<const std::uint8_t> own,
                   const std::vector<SpringRecord>& springs) {
    Known& known = at(step_);
    for (int i = 0; i < world_.bodies(); ++i)
        if (own[static_cast<std::size_t>(i)] != 0 ||
            (complete_ && known.body[static_cast<std::size_t>(i)] != 0))  // of others only marked
            known.bodies.push_back(world_.record(i));
    const WorldSnapshot now = world_.snapshot();
    known.contacts.insert(known.contacts.end(), now.contacts.begin(), now.contacts.end());
    const std::vector<SpringRecord>& held = complete_ ? now.springs : springs;
    known.springs.insert(known.springs.end(), held.begin(), held.end());
    world_.rewind(before);
    --step_;
    whole_ = true, complete_ = false;
}

void Replica::jump(const WorldSnapshot& snapshot) {
    if (snapshot.step > 0) begin_at(snapshot.step - 1);
    world_.rewind(snapshot);
    step_ = snapshot.step;
    whole_ = true, complete_ = false;
    known_.erase(known_.begin(), known_.upper_bound(step_));
}

}  // namespace sim
