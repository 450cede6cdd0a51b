#include "shared/shared_contacts.h"

#include <algorithm>

namespace sim {

SharedContacts::SharedContacts(SharedWorld& world, const ForeignBodies& foreign, std::uint32_t self,
                               Owners owners, int keep)
    : world_(&world),
      foreign_(&foreign),
      self_(self),
      owners_(owners),
      keep_(static_cast<std::uint64_t>(keep)) {}

std::uint32_t SharedContacts::owner(int body, std::uint64_t step) const {
    const auto sale = std::ranges::find_if(
        sales_, [&](const PastSale& s) { return static_cast<int>(s.body) == body && s.step >= step; });
    return sale != sales_.end() ? sale->before : owners_.owner[static_cast<std::size_t>(body)];
}

// Corrects the own body of a pair. `own`, `theirs`: what the two workers found; nullptr: nothing.
void SharedContacts::correct(const CrossImpulse* own, const CrossImpulse* theirs) {
    double share = 0.5;  // of the difference
    if ((own && own->rebound) || (theirs && theirs->rebound)) {
        const bool own_is_lower = own ? own->own < own->ghost : theirs->ghost < theirs->own;
        share = own_is_lower ? 0 : 1;
    }
    Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = linear;
    if (own) linear -= share * own->linear, angular -= share * own->angular_own;
    if (theirs) linear -= share * theirs->linear, angular += share * theirs->angular_ghost;
    const int body = own ? own->own : theirs->ghost;
    if (body < world_->bodies()) world_->kick(body, linear, angular);
}

// Compares what was found between an own body and bodies of `worker`.
void SharedContacts::compare_body(int body, std::uint32_t worker, std::uint64_t step) {
    static const std::vector<CrossImpulse> kNone;
    const ForeignBodies::ReceivedStep* own = foreign_->received(self_, step);
    const std::vector<CrossImpulse>&here = own ? own->crossed : kNone,
          &there = foreign_->received(worker, step)->crossed;
    for (const CrossImpulse& found : std::ranges::equal_range(here, body, {}, &CrossImpulse::own))
        if (owner(found.ghost, step) == worker) correct(&found, find_pair(there, found.ghost, body));
    for (const CrossImpulse& found : there)
        if (found.ghost == body && !find_pair(here, body, found.own)) correct(nullptr, &found);
}

void SharedContacts::compare(std::uint32_t worker, std::uint64_t step, std::uint64_t now) {
    const ForeignBodies::ReceivedStep *theirs = foreign_->received(worker, step),
                                      *own = foreign_->received(self_, step);
    if (!theirs || !theirs->complete) return;
    std::erase_if(sales_, [&](const PastSale& sale) { return sale.step + keep_ < now; });
    touched_.clear();
    if (own)
        for (const CrossImpulse& found : own->crossed)
            if (owner(found.ghost, step) == worker) touched_.push_back(found.own);
    for (const CrossImpulse& found : theirs->crossed) touched_.push_back(found.ghost);
    std::ranges::sort(touched_);
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    for (const int body : touched_)
        if (const auto at = static_cast<std::size_t>(body);
            owners_.own[at] != 0 && owners_.waiting[at] == 0 && owner(body, step) == self_)
            compare_body(body, worker, step);
}

void SharedContacts::compare_bought(int body, std::uint32_t worker, std::uint64_t from, std::uint64_t until) {
    for (std::uint64_t step = std::max(from, until > keep_ ? until - keep_ : 0); step++ < until;)
        if (const auto* theirs = foreign_->received(worker, step); theirs && theirs->complete)
            compare_body(body, worker, step);
}

}  // namespace sim
