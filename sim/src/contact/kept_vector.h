#pragma once
#include <cstddef>
#include <vector>

namespace sim {

/// A vector that keeps its elements when it becomes shorter, so that becoming longer again constructs none: they hold what
/// they held.
template <typename T>
class KeptVector {
public:
    void resize(std::size_t size) {
        if (size > all_.size()) all_.resize(size);
        size_ = size;
    }
    void clear() noexcept { size_ = 0; }
    /// One more, as it was.
    [[nodiscard]] T& extend() {
        resize(size_ + 1);
        return back();
    }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] T* data() noexcept { return all_.data(); }
    [[nodiscard]] const T* data() const noexcept { return all_.data(); }
    [[nodiscard]] T* begin() noexcept { return data(); }
    [[nodiscard]] T* end() noexcept { return data() + size_; }
    [[nodiscard]] const T* begin() const noexcept { return data(); }
    [[nodiscard]] const T* end() const noexcept { return data() + size_; }
    [[nodiscard]] T& operator[](std::size_t i) { return all_[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const { return all_[i]; }
    [[nodiscard]] T& back() { return all_[size_ - 1]; }

private:
    std::vector<T> all_;
    std::size_t size_ = 0;
};

}  // namespace sim
