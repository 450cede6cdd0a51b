#include <algorithm>
#include <utility>

#include "shared/bounded_exchange.h"

// Who owns what: what the application says of it, bodies that come here and go, and what has to be known for that.

namespace sim {
namespace {

constexpr std::uint64_t kForever = ~std::uint64_t{0};

}  // namespace

void BoundedExchange::members(const Members& message, std::uint32_t epoch) {
    epoch_ = epoch;
    for (const std::uint32_t was : members_) {
        if (std::ranges::find(message.workers, was) != message.workers.end()) continue;
        known_[was] = kForever;
        telling_.remove(was);
        for (Purchase& purchase : purchases_) purchase.silent.erase(was);
    }
    members_ = message.workers;
    complete();
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || telling_.has(worker)) continue;
        telling_.add(worker);
        if (step_ == 0 && !late_) continue;
        see_own();  // it has to know how far this one is
        auto& told = std::get<NeighbourMessage>(to_neighbour_);
        told.own = static_cast<std::uint32_t>(owned_.size());
        told.reach = telling_.reach(coming()), told.broken.clear(), told.places.clear();
        for (const std::uint32_t c : breakable_)
            if (!world_.constraint_holds(static_cast<int>(c))) told.broken.push_back(c);
        tell(worker);
    }
    owners_follow_ = message.owners_follow;
}

// Others' bodies, unless more is known of them. They count until their owners have heard of the change.
void BoundedExchange::take_around(const Ownership& ownership) {
    for (std::size_t i = 0; i < ownership.around.size(); ++i) {
        const WorldRecord& record = ownership.around[i];
        const auto at = static_cast<std::size_t>(record.body);
        if (own_[at] != 0 || owner_[at] == self_) continue;
        since_[at] = epoch_;
        if (!foreign_.known(record.body) || foreign_.newest(record.body) < ownership.around_step[i])
            foreign_.set(record, ownership.around_step[i]);
    }
}

void BoundedExchange::own(const Ownership& ownership, std::uint32_t epoch) {
    epoch_ = epoch;
    const std::uint32_t owner = ownership.owner, from = ownership.from;
    const bool changes = from != kApplication && from != owner;  // else they are the first, or come back
    // A worker that owned nothing begins here.
    if (owner != self_ && !owners_.contains(owner)) {
        begun_[owner] = ownership.step;
        known_[owner] = std::max(known_[owner], ownership.step);
    }
    std::vector<int> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        const auto at = static_cast<std::size_t>(record.body);
        bodies.push_back(record.body);
        since_[at] = epoch, owner_[at] = owner;
        if (changes) contacts_.sold({static_cast<std::uint32_t>(record.body), from, ownership.step});
        if (owner != self_ && own_[at] != 0) set_own(record.body, false);
        // As last published: who was told has that, with the forces that held the bodies. What a lost worker told besides is void.
        if (ownership.traded || foreign_.newest(record.body) != ownership.step)
            foreign_.set(record, ownership.step);
    }
    owners_ = {owner_.begin(), owner_.end()};
    std::ranges::sort(bodies);
    if (owner == self_) {
        take_around(ownership);
        if (changes) {
            purchases_.push_back({epoch, {}});
            telling_.each([this](std::uint32_t worker) { purchases_.back().silent.insert(worker); });
        }
        later_.push_back({ownership, epoch});
        follow();
        take_due();
    } else if (telling_.has(owner)) {
        see_own();
        telling_.got(owner, ownership.bodies, epoch);
        if (changes) send(FoundMessage{owner, epoch, foreign_.found_at(bodies)});
    }
    list();
}

// Without bodies that are there: on to the first that come, but not past anybody.
void BoundedExchange::follow() {
    if (!owned_.empty() || later_.empty()) return;
    std::uint64_t next = slowest();
    for (const Later& later : later_) next = std::min(next, later.ownership.step);
    if (next <= step_) return;
    come_to(next);
    step_ = next;
    world_.set_step(step_);
    take_due();
}

void BoundedExchange::take_due() {
    for (std::size_t i = 0; i < later_.size();) {
        if (later_[i].ownership.step > step_) {
            ++i;
            continue;
        }
        const Later due = std::move(later_[i]);
        later_.erase(later_.begin() + static_cast<std::ptrdiff_t>(i));
        take_over(due);
    }
}

// The bodies as they are at this worker's step.
void BoundedExchange::take_over(const Later& later) {
    const Ownership& ownership = later.ownership;
    settled_ = false;
    std::vector<int> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        const int body = record.body;
        if (owner_[static_cast<std::size_t>(body)] != self_) continue;  // gone again
        if (body < world_.bodies()) {
            WorldRecord now = record;
            if (step_ > ownership.step) {
                const ForeignBodies::Ghost& ghost = foreign_.at(body, step_);
                now.state = ghost.state;
                now.asleep = now.asleep && ghost.asleep;
            }
            set_own(body, true);
            world_.restore(now);
            bodies.push_back(body);
        } else {
            set_own(body, true);
            if (owned_.empty())
                come_to(step_);  // its event may be due, and nothing else takes this worker on
        }
    }
    list();
    bought(std::move(bodies), later.epoch);
}

// They are own from here on, up to where the seller compared what others found. (Of a lost worker's bodies nobody knows what was compared.)
void BoundedExchange::bought(std::vector<int>&& bodies, std::uint32_t epoch) {
    const auto purchase = std::ranges::find(purchases_, epoch, &Purchase::epoch);
    if (purchase == purchases_.end()) return;  // they come back
    for (const int body : bodies) awaits_[static_cast<std::size_t>(body)] = 1;
    purchase->bodies = std::move(bodies), purchase->step = step_;
    complete();
}

// Purchases of which all others have told what they found.
void BoundedExchange::complete() {
    for (const Purchase& purchase : purchases_) {
        if (!purchase.is_complete()) continue;
        for (const int body : purchase.bodies) {
            const auto at = static_cast<std::size_t>(body);
            if (own_[at] == 0 || since_[at] != purchase.epoch) continue;
            awaits_[at] = 0;
            for (const auto& [worker, heard] : foreign_.all())
                if (worker != self_)
                    contacts_.took(body, worker, *purchase.step, std::min(told(worker), step_));
        }
    }
    std::erase_if(purchases_, [](const Purchase& purchase) { return purchase.is_complete(); });
}

// Whether all is known here that others found up to a step.
bool BoundedExchange::all_is_told(std::uint64_t step) const {
    return std::ranges::all_of(members_, [&](std::uint32_t worker) {
        return worker == self_ || !owns_any(worker) || told(worker) >= step || begins_at(worker, step);
    });
}

bool BoundedExchange::begins_at(std::uint32_t worker, std::uint64_t step) const {
    const auto begun = begun_.find(worker);
    return begun != begun_.end() && begun->second >= step;
}

// What others have not told of own bodies for so long would be forgotten here before it is compared.
bool BoundedExchange::is_waited_for() const {
    return std::ranges::any_of(purchases_, [this](const Purchase& p) {
        return p.step && *p.step + static_cast<std::uint64_t>(comparison_steps(settings_.bound)) <= step_;
    });
}

// What others found up to this step at own bodies is known and compared.
bool BoundedExchange::may_give() const {
    return all_is_told(step_) &&
           std::ranges::none_of(purchases_, [](const Purchase& p) { return p.step.has_value(); });
}

bool BoundedExchange::owns_any(std::uint32_t worker) const {
    return std::find(members_.begin(), members_.end(), worker) != members_.end() && owners_.contains(worker);
}

std::uint64_t BoundedExchange::slowest() const {
    if (owners_follow_) return 0;  // whoever that may be
    std::uint64_t slowest = kForever;
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || !owns_any(worker)) continue;
        slowest = std::min(slowest, known(worker));
    }
    return slowest;
}

// Bodies that are registered for this worker, and come in later steps.
std::vector<WorldRecord> BoundedExchange::coming() const {
    std::vector<WorldRecord> bodies;
    for (const Later& later : later_)
        bodies.insert(bodies.end(), later.ownership.bodies.begin(), later.ownership.bodies.end());
    return bodies;
}

Handover BoundedExchange::give(const std::vector<std::uint32_t>& bodies) {
    Handover handover;
    for (const std::uint32_t id : bodies) {
        const int body = static_cast<int>(id);
        handover.bodies.push_back(world_.record(body));
        foreign_.set(handover.bodies.back(), step_);
        set_own(body, false);
    }
    list();
    return handover;
}

}  // namespace sim
