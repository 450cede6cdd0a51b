#include <algorithm>
#include <utility>

#include "shared/bounded_exchange.h"

// Ownership: what the application says of members and owners, and bodies that this worker takes over and
// hands over.

namespace sim {
namespace {

constexpr std::uint64_t kForever = ~std::uint64_t{0};

}  // namespace

void BoundedExchange::set_members(const Members& message, std::uint32_t epoch) {
    epoch_ = epoch;
    for (const std::uint32_t was : members_) {
        if (std::ranges::find(message.workers, was) != message.workers.end()) continue;
        peers_[was].steps = kForever;
        border_.remove(was);
        for (Purchase& purchase : purchases_) purchase.waiting_for.erase(was);
    }
    members_ = message.workers;
    finish_purchases();
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || border_.has(worker)) continue;
        border_.add(worker);
        if (step_ == 0 && !late_) continue;
        collect_own();  // the new member has to know this worker's step and states
        auto& first = std::get<NeighbourMessage>(to_neighbour_);
        first.own = static_cast<std::uint32_t>(owned_.size());
        first.reach = border_.reach(future_bodies()), first.broken.clear(), first.places.clear();
        for (const std::uint32_t c : breakable_)
            if (!world_.constraint_holds(static_cast<int>(c))) first.broken.push_back(c);
        send_border(worker);
    }
    owners_follow_ = message.owners_follow;
}

// Others' bodies near those that this worker gets. They count as current until their owners know of the
// change.
void BoundedExchange::set_surroundings(const Ownership& ownership) {
    for (std::size_t i = 0; i < ownership.around.size(); ++i) {
        const WorldRecord& record = ownership.around[i];
        const auto at = static_cast<std::size_t>(record.body);
        if (own_[at] != 0 || owner_[at] == self_) continue;
        since_[at] = epoch_;
        if (!foreign_.known(record.body) || foreign_.latest_step(record.body) < ownership.around_step[i])
            foreign_.set(record, ownership.around_step[i]);
    }
}

void BoundedExchange::set_owner(const Ownership& ownership, std::uint32_t epoch) {
    epoch_ = epoch;
    const std::uint32_t owner = ownership.owner, from = ownership.from;
    const bool changes =
        from != kApplication && from != owner;         // else it is the first owner, or gets them back
    if (owner != self_ && !owners_.contains(owner)) {  // it owned nothing and continues at this step
        Peer& its = peers_[owner];
        its.begun = ownership.step;
        its.steps = std::max(its.steps, ownership.step);
    }
    std::vector<int> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        const auto at = static_cast<std::size_t>(record.body);
        bodies.push_back(record.body);
        since_[at] = epoch, owner_[at] = owner;
        if (changes) contacts_.add_sale({static_cast<std::uint32_t>(record.body), from, ownership.step});
        if (owner != self_ && own_[at] != 0) set_own(record.body, false);
        // After a loss the record is the last one that was published. If the lost worker sent the state of
        // this very step here, that state is kept, as it has the impulses that held the body. Later states of
        // that worker are void.
        if (ownership.traded || foreign_.latest_step(record.body) != ownership.step)
            foreign_.set(record, ownership.step);
    }
    owners_ = {owner_.begin(), owner_.end()};
    std::ranges::sort(bodies);
    if (owner == self_) {
        set_surroundings(ownership);
        if (changes) {
            purchases_.push_back({epoch, {}});
            border_.for_each([this](std::uint32_t worker) { purchases_.back().waiting_for.insert(worker); });
        }
        future_.push_back({ownership, epoch});
        advance_without_bodies();
        take_over_due();
    } else if (border_.has(owner)) {
        collect_own();
        border_.add_gained(owner, ownership.bodies, epoch);
        if (changes) send(FoundMessage{owner, epoch, foreign_.found_at(bodies)});
    }
    list_bodies();
}

// To the step of the first bodies that this worker gets, but not past any other worker.
void BoundedExchange::advance_without_bodies() {
    if (!owned_.empty() || future_.empty()) return;
    std::uint64_t next = least_steps();
    for (const FutureOwnership& future : future_) next = std::min(next, future.ownership.step);
    if (next <= step_) return;
    apply_events(next);
    step_ = next;
    world_.set_step(step_);
    take_over_due();
}

void BoundedExchange::take_over_due() {
    for (std::size_t i = 0; i < future_.size();) {
        if (future_[i].ownership.step > step_) {
            ++i;
            continue;
        }
        const FutureOwnership due = std::move(future_[i]);
        future_.erase(future_.begin() + static_cast<std::ptrdiff_t>(i));
        take_over(due);
    }
}

// Takes bodies over, in their states at this worker's step.
void BoundedExchange::take_over(const FutureOwnership& due) {
    const Ownership& ownership = due.ownership;
    settled_ = false;
    std::vector<int> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        const int body = record.body;
        if (owner_[static_cast<std::size_t>(body)] != self_) continue;  // it was sold or lost meanwhile
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
                apply_events(step_);  // the event that adds it may be due, and no step applies it
        }
    }
    list_bodies();
    begin_purchase(std::move(bodies), due.epoch);
}

// The seller has compared everything up to this step. After a loss nobody knows what the lost worker had
// compared.
void BoundedExchange::begin_purchase(std::vector<int>&& bodies, std::uint32_t epoch) {
    const auto purchase = std::ranges::find(purchases_, epoch, &Purchase::epoch);
    if (purchase == purchases_.end()) return;  // the bodies came back to this worker
    for (const int body : bodies) waiting_[static_cast<std::size_t>(body)] = 1;
    purchase->bodies = std::move(bodies), purchase->step = step_;
    finish_purchases();
}

// Compares what was found at bought bodies once all others have sent it.
void BoundedExchange::finish_purchases() {
    for (const Purchase& purchase : purchases_) {
        if (!purchase.is_complete()) continue;
        for (const int body : purchase.bodies) {
            const auto at = static_cast<std::size_t>(body);
            if (own_[at] == 0 || since_[at] != purchase.epoch) continue;
            waiting_[at] = 0;
            for (const auto& [worker, steps] : foreign_.all())
                if (worker != self_)
                    contacts_.compare_bought(body, worker, *purchase.step,
                                             std::min(peer(worker).message_step, step_));
        }
    }
    std::erase_if(purchases_, [](const Purchase& purchase) { return purchase.is_complete(); });
}

// Whether everything is known here that others found up to a step.
bool BoundedExchange::all_reported(std::uint64_t step) const {
    return std::ranges::all_of(members_, [&](std::uint32_t worker) {
        return worker == self_ || !owns_bodies(worker) ||
               std::max(peer(worker).message_step, peer(worker).begun) >= step;
    });
}

// Own impulses are kept for some steps only. A purchase that is not complete by then stops this worker.
bool BoundedExchange::comparison_is_overdue() const {
    return std::ranges::any_of(purchases_, [this](const Purchase& p) {
        return p.step && *p.step + static_cast<std::uint64_t>(comparison_steps(settings_.bound)) <= step_;
    });
}

bool BoundedExchange::may_hand_over() const {
    return all_reported(step_) &&
           std::ranges::none_of(purchases_, [](const Purchase& p) { return p.step.has_value(); });
}

bool BoundedExchange::owns_bodies(std::uint32_t worker) const {
    return std::ranges::find(members_, worker) != members_.end() && owners_.contains(worker);
}

// Steps of the slowest other worker that owns bodies.
std::uint64_t BoundedExchange::least_steps() const {
    if (owners_follow_) return 0;  // any member may turn out to own bodies
    std::uint64_t least = kForever;
    for (const std::uint32_t worker : members_)
        if (worker != self_ && owns_bodies(worker)) least = std::min(least, steps_of(worker));
    return least;
}

std::vector<WorldRecord> BoundedExchange::future_bodies() const {
    std::vector<WorldRecord> bodies;
    for (const FutureOwnership& future : future_)
        bodies.insert(bodies.end(), future.ownership.bodies.begin(), future.ownership.bodies.end());
    return bodies;
}

Handover BoundedExchange::hand_over(const std::vector<std::uint32_t>& bodies) {
    Handover handover;
    for (const std::uint32_t id : bodies) {
        const int body = static_cast<int>(id);
        handover.bodies.push_back(world_.record(body));
        foreign_.set(handover.bodies.back(), step_);
        set_own(body, false);
    }
    list_bodies();
    return handover;
}

}  // namespace sim
