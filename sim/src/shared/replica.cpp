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

bool SceneClock::apply(World& world, std::uint64_t step) {
    busy_ = static_cast<double>(step) * world.settings().dt < busy_until_s_;
    const std::size_t before = next_;
    for (; next_ < scene_.events.size() && scene_.events[next_].step <= step; ++next_) {
        const WorldEvent& event = scene_.events[next_];
        for (const int constraint : event.removed)
            if (world.constraint_holds(constraint)) world.remove_constraint(constraint);
        for (std::size_t i = event.first; i < event.end; ++i) (void)world.add_body(scene_.later[i]);
    }
    return next_ > before;
}

int SceneClock::moving(std::uint64_t step) const {
    int count = moving_at_first_;
    for (int i = first_later_; i < bodies(); ++i) count += moves_at(i, step);
    return count;
}

bool is_still(const WorldRecord& record, double dt) noexcept {
    return record.asleep || record.still_steps * dt >= 0.5 - 1e-9;
}

Replica::Replica(const WorldScene& scene) : world_(scene.world), clock_(scene) {
    for (int i = 0; i < world_.bodies(); ++i) world_.set_own(i, false);
}

bool Replica::begin_at(std::uint64_t step) {
    const int before = world_.bodies();
    const bool any = clock_.apply(world_, step);
    for (int i = before; i < world_.bodies(); ++i) world_.set_own(i, false);
    return any;
}

Replica::Known& Replica::at(std::uint64_t step) {
    Known& known = known_[step];
    if (known.body.empty()) known.body.assign(static_cast<std::size_t>(clock_.bodies()), kUnknown);
    return known;
}

const Replica::Known* Replica::find(std::uint64_t step) const {
    const auto found = known_.find(step);
    return found == known_.end() ? nullptr : &found->second;
}

void Replica::mark(Known& known, std::uint64_t step, int body) const {
    std::uint8_t& there = known.body[static_cast<std::size_t>(body)];
    if (there != kUnknown || !clock_.moves_at(body, step)) return;
    there = kPublished;
    ++known.published;
}

void Replica::mark(std::uint64_t step, std::span<const std::uint32_t> bodies) {
    if (step < step_ || (step == step_ && whole_)) return;
    Known& known = at(step);
    for (const std::uint32_t body : bodies)
        if (body < known.body.size()) mark(known, step, static_cast<int>(body));
}

void Replica::note(std::uint64_t step, StateMessage&& states) {
    if (step < step_ || (step == step_ && whole_)) return;
    Known& known = at(step);
    for (WorldRecord& record : states.bodies) {
        mark(known, step, record.body);
        if (known.body[static_cast<std::size_t>(record.body)] != kPublished) continue;
        known.body[static_cast<std::size_t>(record.body)] = kRecorded;
        ++known.recorded;
        known.records.bodies.push_back(std::move(record));
    }
    auto& [at_step, bodies, contacts, springs, outside] = known.records;
    contacts.insert(contacts.end(), states.contacts.begin(), states.contacts.end());
    springs.insert(springs.end(), states.springs.begin(), states.springs.end());
    at_step = step, outside = states.report.outside_impulse;
}

bool Replica::misses_records() const {
    const Known* next = find(step_ + 1);
    return next && next->recorded < next->published;
}

void Replica::sort_contacts(std::vector<ContactRecord>& contacts) {
    auto key = [](const ContactRecord& c) { return std::pair(c.a, c.b); };
    std::ranges::sort(contacts, {}, key);
    contacts.erase(std::ranges::unique(contacts, {}, key).begin(), contacts.end());
}

bool Replica::advance(bool along) {
    if (!whole_) {
        const Known* now = find(step_);
        if ((now ? now->published : 0) < clock_.moving(step_)) return false;
    } else {
        const Known* next = find(step_ + 1);
        if (!along || (next ? next->recorded : 0) < clock_.moving(step_ + 1)) return false;
        begin();
        ++step_;
        WorldSnapshot& records = at(step_).records;
        records.step = step_;
        sort_contacts(records.contacts);
        world_.rewind(records);
    }
    whole_ = true;
    known_.erase(known_.begin(), known_.upper_bound(step_));
    return true;
}

void Replica::stepped() {
    ++step_;
    whole_ = false;
}

void Replica::jump(const WorldSnapshot& snapshot) {
    if (snapshot.step > 0) begin_at(snapshot.step - 1);
    world_.rewind(snapshot);
    step_ = snapshot.step;
    whole_ = true;
    known_.erase(known_.begin(), known_.upper_bound(step_));
}

}  // namespace sim
