#pragma once
#include <algorithm>
#include <numeric>
#include <vector>

namespace sim {

/// Numbers 0 to size - 1, in sets that are joined; each set is known by its first number.
class DisjointSets {
public:
    explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
    [[nodiscard]] int first(int number) {
        int& parent = parent_[static_cast<std::size_t>(number)];
        while (parent != parent_[static_cast<std::size_t>(parent)])
            parent = parent_[static_cast<std::size_t>(parent)];
        return parent;
    }
    void join(int a, int b) {
        const int first_a = first(a), first_b = first(b);
        parent_[static_cast<std::size_t>(std::max(first_a, first_b))] = std::min(first_a, first_b);
    }

private:
    std::vector<int> parent_;
};

}  // namespace sim
