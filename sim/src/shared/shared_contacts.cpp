#include "shared/shared_contacts.h"

#include <algorithm>

namespace sim {
namespace {

const std::vector<CrossImpulse> kNothing;

std::pair<int, int> pair_of(const CrossImpulse& c) {
    return {c.own, c.ghost};
}

const CrossImpulse* find(const std::vector<CrossImpulse>& crossed, int own, int ghost) {
    const auto found = std::ranges::lower_bound(crossed, std::pair(own, ghost), {}, pair_of);
    return found == crossed.end() || pair_of(*found) != std::pair(own, ghost) ? nullptr : &*found;
}

}  // namespace

SharedContacts::SharedContacts(World& world, const ForeignBodies& heard, std::uint32_t self, Owners owners,
                               int keep, int window)
    : world_(&world),
      heard_(&heard),
      self_(self),
      owners_(owners),
      keep_(static_cast<std::uint64_t>(keep)),
      window_(static_cast<std::uint64_t>(window)) {}

// What the owner of a body found in a step of it and another one's; nullptr: nothing.
const CrossImpulse* SharedContacts::found_by_owner(int body, int other, std::uint64_t step) const {
    const ForeignBodies::Heard* heard = heard_->heard(owner(body, step), step);
    return heard ? find(heard->crossed, body, other) : nullptr;
}

// By how many blows of the steps before `step` the owner of `low` is ahead of the other one.
int SharedContacts::blows_ahead(int low, int high, std::uint64_t step) const {
    int ahead = 0;
    for (std::uint64_t t = step > window_ ? step - window_ : 0; t < step; ++t) {
        const CrossImpulse *by_low = found_by_owner(low, high, t), *by_high = found_by_owner(high, low, t);
        ahead += (by_low && by_low->blow) - (by_high && by_high->blow);
    }
    return ahead;
}

// Which of the two counts, see the class.
SharedContacts::Shares SharedContacts::shares(const CrossImpulse* found, const CrossImpulse* told,
                                              std::uint64_t step) const {
    const bool here = found && found->blow, there = told && told->blow;
    if (!here && !there) return {-0.5, 0.5};
    const auto [low, high] =
        found ? std::minmax(found->own, found->ghost) : std::minmax(told->own, told->ghost);
    const bool lower_here = found ? found->own == low : told->ghost == low;
    bool counts_here = here, counts_there = there;
    if (here && there) {
        counts_here = lower_here, counts_there = !lower_here;
    } else if (const int ahead = blows_ahead(low, high, step); here == lower_here ? ahead < 0 : ahead > 0) {
        counts_here = counts_there = false;  // the other one saw it before
    }
    // Of a rebound and what is none one counts whole, too: half of the other would be more than either.
    if (found && told && here != there) counts_here = here ? counts_here : !counts_there;
    if (found && told) return counts_here ? Shares{0, 0} : Shares{-1, 1};
    return {counts_here ? 0.0 : -1.0, counts_there ? 1.0 : 0.0};
}

// The first sale of a body at or after the end of a step.
const SharedContacts::Sale* SharedContacts::sale_after(int body, std::uint64_t step) const {
    const auto found =
        std::ranges::find_if(sales_, [&](const Sale& s) { return s.body == body && s.step >= step; });
    return found == sales_.end() ? nullptr : &*found;
}

// Who did a body's step `step`.
std::uint32_t SharedContacts::owner(int body, std::uint64_t step) const {
    const Sale* sale = sale_after(body, step);
    return sale ? sale->before : owners_.owner[static_cast<std::size_t>(body)];
}

void SharedContacts::put_right(const CrossImpulse* found, const CrossImpulse* told, const Occasion& of) {
    const Shares share = shares(found, told, of.step);
    Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = linear;
    if (found) linear += share.found * found->linear, angular += share.found * found->angular_own;
    if (told) linear -= share.told * told->linear, angular += share.told * told->angular_ghost;
    const int body = found ? found->own : told->ghost;
    if (body < world_->bodies()) world_->kick(body, linear, angular);
}

// What was found at an own body and at what it touched then.
void SharedContacts::compare(const Occasion& of, int body) {
    const ForeignBodies::Heard *mine = heard_->heard(self_, of.step),
                               *theirs = heard_->heard(of.worker, of.step);
    const std::vector<CrossImpulse>&here = mine ? mine->crossed : kNothing, &there = theirs->crossed;
    for (const CrossImpulse& found : std::ranges::equal_range(here, body, {}, &CrossImpulse::own))
        if (owner(found.ghost, of.step) == of.worker) put_right(&found, find(there, found.ghost, body), of);
    for (const CrossImpulse& told : there)
        if (told.ghost == body && !find(here, body, told.own)) put_right(nullptr, &told, of);
}

void SharedContacts::compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now) {
    const ForeignBodies::Heard *theirs = heard_->heard(worker, step), *mine = heard_->heard(self_, step);
    if (!theirs || !theirs->there) return;
    std::erase_if(sales_, [&](const Sale& sale) { return sale.step + keep_ < now; });
    touched_.clear();
    if (mine)
        for (const CrossImpulse& found : mine->crossed)
            if (owner(found.ghost, step) == worker) touched_.push_back(found.own);
    for (const CrossImpulse& told : theirs->crossed) touched_.push_back(told.ghost);
    std::ranges::sort(touched_);
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    for (const int body : touched_)
        if (const auto at = static_cast<std::size_t>(body);
            owners_.own[at] != 0 && owners_.awaits[at] == 0 && owner(body, step) == self_)
            compare({worker, step}, body);
}

void SharedContacts::sold(int body, std::uint32_t before, std::uint64_t step) {
    sales_.push_back({body, before, step});
}

void SharedContacts::took(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until) {
    for (std::uint64_t step = std::max(from, until > keep_ ? until - keep_ : 0); step++ < until;)
        if (const ForeignBodies::Heard* theirs = heard_->heard(worker, step); theirs && theirs->there)
            compare({worker, step}, body);
}

}  // namespace sim
