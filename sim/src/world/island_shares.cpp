#include "world/island_shares.h"

#include <algorithm>

namespace sim {
void keep_once(std::vector<std::uint32_t>& bodies) {
    std::ranges::sort(bodies);
    bodies.erase(std::ranges::unique(bodies).begin(), bodies.end());
}

void IslandShares::divide(int self, std::span<const double> shares, const std::vector<Manifold>& all,
                          const std::vector<int>& local) {
    self_ = self;
    cut(shares);
    for (Border& border : borders_) border.partner = -1;
    turns_.clear();
    if (first_slab_ == last_slab_) return;
    if (first_slab_ > 0) {
        borders_[0].partner = owner_of_slab_[first_slab_ - 1];
        borders_[0].block = blocks_->interface_after(first_slab_ - 1);
        find_border(borders_[0], first_slab_, all, local);
    }
    if (last_slab_ < blocks_->slabs()) {
        borders_[1].partner = owner_of_slab_[last_slab_];
        borders_[1].block = blocks_->interface_after(last_slab_ - 1);
        find_border(borders_[1], last_slab_ - 1, all, local);
    }
    order_turns();
}

void IslandShares::cut(std::span<const double> shares) {
    const std::size_t partners = shares.size(), slabs = blocks_->slabs();
    std::vector<double> load(slabs, 0);
    for (std::size_t s = 0; s < slabs; ++s)
        load[s] += 1 + static_cast<double>(blocks_->manifolds_of(s).size());
    for (std::size_t s = 0; s + 1 < slabs; ++s) {
        const double half =
            static_cast<double>(blocks_->manifolds_of(blocks_->interface_after(s)).size()) / 2;
        load[s] += half, load[s + 1] += half;
    }
    double load_in_all = 0, before = 0, shares_in_all = 0;
    for (const double l : load) load_in_all += l;
    for (const double s : shares) shares_in_all += s;
    const auto load_of = [&](std::size_t partner) {
        return load_in_all *
               (shares_in_all > 0 ? shares[partner] / shares_in_all : 1 / static_cast<double>(partners));
    };
    cuts_.assign(partners + 1, slabs);
    cuts_[0] = 0;
    std::size_t partner = 0;
    double until = load_of(0);
    for (std::size_t s = 0; s < slabs; ++s) {
        const double middle = before + load[s] / 2;
        while (partner + 1 < partners && middle > until) {
            cuts_[++partner] = s;
            until += load_of(partner);
        }
        before += load[s];
    }
    first_slab_ = last_slab_ = 0;
    if (self_ >= 0)
        first_slab_ = cuts_[static_cast<std::size_t>(self_)],
        last_slab_ = cuts_[static_cast<std::size_t>(self_) + 1];
    owner_of_slab_.resize(slabs);
    for (std::size_t p = 0; p < partners; ++p)
        for (std::size_t slab = cuts_[p]; slab < cuts_[p + 1]; ++slab)
            owner_of_slab_[slab] = static_cast<int>(p);
}

void IslandShares::find_border(Border& border, std::size_t own_slab, const std::vector<Manifold>& all,
                               const std::vector<int>& local) const {
    border.own.clear(), border.theirs.clear();
    for (const int m : blocks_->manifolds_of(border.block)) {
        const Manifold& manifold = all[static_cast<std::size_t>(m)];
        for (const int id : {manifold.a, manifold.b}) {
            const auto body = static_cast<std::size_t>(local[static_cast<std::size_t>(id)]);
            (blocks_->slab_of(body) == own_slab ? border.own : border.theirs)
                .push_back(static_cast<std::uint32_t>(body));
        }
    }
    keep_once(border.own), keep_once(border.theirs);
}

void IslandShares::order_turns() {
    std::vector<std::size_t>& left = blocks_left_;
    left.clear();
    for (std::size_t b = 0; b < blocks_->size(); ++b)
        if (sweeps((*blocks_)[b])) left.push_back(b);
    auto border_of = [this](std::size_t block) {
        for (int i = 0; i < 2; ++i)
            if (const Border& border = borders_[static_cast<std::size_t>(i)];
                border.partner >= 0 && border.block == block)
                return i;
        return -1;
    };
    auto meets_within = [this](const IslandBlocks::Block& a, const IslandBlocks::Block& b) {
        const std::size_t first = std::max<std::size_t>({a.slab, b.slab, first_slab_}),
                          last = std::min<std::size_t>({a.slab + a.slabs, b.slab + b.slabs, last_slab_});
        return first < last;
    };
    auto waits = [&](std::size_t block, std::size_t before) {
        return before < block && meets_within((*blocks_)[before], (*blocks_)[block]);
    };
    auto is_ready = [&](std::size_t block) {
        return std::ranges::none_of(left, [&](std::size_t before) { return waits(block, before); });
    };
    std::array<bool, 2> told{borders_[0].partner < 0, borders_[1].partner < 0};
    auto is_needed = [&](std::size_t block) {
        return (!told[0] && waits(borders_[0].block, block)) || (!told[1] && waits(borders_[1].block, block));
    };
    while (!left.empty()) {
        for (int i = 0; i < 2; ++i)
            if (const std::size_t at = static_cast<std::size_t>(i);
                !told[at] && is_ready(borders_[at].block)) {
                turns_.push_back({borders_[at].block, i, true});
                told[at] = true;
            }
        const std::size_t none = blocks_->size();
        std::size_t next = none, border = none;
        for (const std::size_t block : left) {
            if (!is_ready(block)) continue;
            if (border_of(block) >= 0) {
                border = std::min(border, block);
            } else if (next == none || (is_needed(block) && !is_needed(next))) {
                next = block;
            }
        }
        if (next == none) next = border;
        turns_.push_back({next, border_of(next), false});
        std::erase(left, next);
    }
}

void IslandShares::group(std::size_t bodies, std::span<const std::pair<int, int>> joined) {
    group_of_.assign(bodies, -1);
    if (joined.empty()) return;
    sets_.reset(bodies);
    for (const auto& [a, b] : joined) {
        for (const int body : {a, b})
            if (body >= 0) group_of_[static_cast<std::size_t>(body)] = 0;
        if (a >= 0 && b >= 0) sets_.join(a, b);
    }
    // Each group's number at its first body.
    int groups = 0;
    for (std::size_t i = 0; i < bodies; ++i) {
        if (group_of_[i] < 0) continue;
        const int first = sets_.first(static_cast<int>(i));
        group_of_[i] = first == static_cast<int>(i) ? groups++ : group_of_[static_cast<std::size_t>(first)];
    }
    concerned_.assign(static_cast<std::size_t>(groups) * partners(), 0);
    for (std::size_t i = 0; i < bodies; ++i) {
        if (group_of_[i] < 0) continue;
        const std::size_t slab = blocks_->slab_of(i), from = slab > 0 ? slab - 1 : 0,
                          until = std::min(slab + 1, blocks_->slabs() - 1);
        for (std::size_t s = from; s <= until; ++s)
            concerned_[static_cast<std::size_t>(group_of_[i]) * partners() +
                       static_cast<std::size_t>(owner_of_slab_[s])] = 1;
    }
}

bool IslandShares::uses(std::size_t body) const {
    return has(body) || concerns(body, self_) || std::ranges::any_of(borders_, [body](const Border& border) {
               return border.partner >= 0 &&
                      std::ranges::binary_search(border.theirs, static_cast<std::uint32_t>(body));
           });
}

}  // namespace sim
