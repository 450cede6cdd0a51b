#pragma once
#include <algorithm>
#include <numeric>
#include <vector>

namespace sim {

/// Numbers 0 to size - 1, in sets that are joined; each set is known by its first number. Union-find with path halving.
class DisjointSets {
public:
    DisjointSets() = default;
    explicit DisjointSets(std::size_t size) { reset(size); }
    /// Each number in a set of its own.
    void reset(std::size_t size) {
        parent_.resize(size);
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    [[nodiscard]] int first(int number) {
        while (parent(number) != number) number = parent(number) = parent(parent(number));
        return number;
    }
    void join(int a, int b) {
        const int first_a = first(a), first_b = first(b);
        parent(std::max(first_a, first_b)) = std::min(first_a, first_b);
    }

private:
    [[nodiscard]] int& parent(int number) { return parent_[static_cast<std::size_t>(number)]; }

    std::vector<int> parent_;
};

}  // namespace sim
