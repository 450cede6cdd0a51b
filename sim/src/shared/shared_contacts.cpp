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

SharedContacts::SharedContacts(SharedWorld& world, const ForeignBodies& heard, std::uint32_t self,
                               Owners owners, int keep)
    : world_(&world), heard_(&heard), self_(self), owners_(owners), keep_(static_cast<std::uint64_t>(keep)) {}

// Which of the two counts, see the class.
SharedContacts::Shares SharedContacts::shares(const CrossImpulse* found, const CrossImpulse* told) {
    if (!(found && found->rebound) && !(told && told->rebound)) return {-0.5, 0.5};
    const bool lower_here = found ? found->own < found->ghost : told->ghost < told->own;
    return lower_here ? Shares{0, 0} : Shares{-1, 1};
}

// The first sale of a body at or after the end of a step.
const PastSale* SharedContacts::sale_after(int body, std::uint64_t step) const {
    const auto found = std::ranges::find_if(
        sales_, [&](const PastSale& s) { return static_cast<int>(s.body) == body && s.step >= step; });
    return found == sales_.end() ? nullptr : &*found;
}

// Who did a body's step `step`.
std::uint32_t SharedContacts::owner(int body, std::uint64_t step) const {
    const PastSale* sale = sale_after(body, step);
    return sale ? sale->before : owners_.owner[static_cast<std::size_t>(body)];
}

void SharedContacts::put_right(const CrossImpulse* found, const CrossImpulse* told) {
    const Shares share = shares(found, told);
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
        if (owner(found.ghost, of.step) == of.worker) put_right(&found, find(there, found.ghost, body));
    for (const CrossImpulse& told : there)
        if (told.ghost == body && !find(here, body, told.own)) put_right(nullptr, &told);
}

void SharedContacts::compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now) {
    const ForeignBodies::Heard *theirs = heard_->heard(worker, step), *mine = heard_->heard(self_, step);
    if (!theirs || !theirs->there) return;
    std::erase_if(sales_, [&](const PastSale& sale) { return sale.step + keep_ < now; });
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

void SharedContacts::took(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until) {
    for (std::uint64_t step = std::max(from, until > keep_ ? until - keep_ : 0); step++ < until;)
        if (const ForeignBodies::Heard* theirs = heard_->heard(worker, step); theirs && theirs->there)
            compare({worker, step}, body);
}

}  // namespace sim
