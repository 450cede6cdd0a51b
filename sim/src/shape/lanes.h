#pragma once
#include <immintrin.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace sim {

/// Eight floats that one AVX instruction handles (two SSE ones in the plain build); arithmetic and comparison
/// work lane by lane, `mask ? a : b` selects.
using Lanes = float __attribute__((vector_size(32)));
using LaneMask = std::int32_t __attribute__((vector_size(32)));
constexpr int kLanes = 8;

[[nodiscard]] constexpr int whole_lanes(int count) noexcept {  ///< rounded up to whole lanes
    return (count + kLanes - 1) / kLanes * kLanes;
}

[[nodiscard]] inline Lanes lanes_of(float value) noexcept {  ///< the same in each lane
    return Lanes{value, value, value, value, value, value, value, value};
}
[[nodiscard]] inline Lanes load_lanes(const float* aligned) noexcept {  ///< eight floats
    return *reinterpret_cast<const Lanes*>(aligned);
}
inline void store_lanes(float* aligned, Lanes value) noexcept {  ///< eight floats
    *reinterpret_cast<Lanes*>(aligned) = value;
}
/// a b + c, rounded once where the processor level has the instruction (written out, as the compiler is told
/// not to contract by itself).
[[nodiscard]] inline Lanes fused(Lanes a, Lanes b, Lanes c) noexcept {
#ifdef __FMA__
    return _mm256_fmadd_ps(a, b, c);
#else
    return a * b + c;
#endif
}
/// One bit per lane.
[[nodiscard]] inline unsigned bits_of(LaneMask mask) noexcept {
#ifdef __AVX__
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
#else
    unsigned result = 0;
    for (int i = 0; i < kLanes; ++i) result |= mask[i] ? 1u << i : 0u;
    return result;
#endif
}
/// Lane i is that of `v` with the number order[i].
[[nodiscard]] inline Lanes picked(Lanes v, LaneMask order) noexcept {
#if __has_builtin(__builtin_shuffle)
    return __builtin_shuffle(v, order);
#else  // clang
    Lanes result{};
    for (int i = 0; i < kLanes; ++i) result[i] = v[order[i]];
    return result;
#endif
}
/// Sum in a fixed order: ((0 + 4) + (2 + 6)) + ((1 + 5) + (3 + 7)).
[[nodiscard]] inline float sum_of(Lanes v) noexcept {
    const Lanes half = v + picked(v, LaneMask{4, 5, 6, 7, 4, 5, 6, 7});
    const Lanes quarter = half + picked(half, LaneMask{2, 3, 2, 3, 2, 3, 2, 3});
    return quarter[0] + quarter[1];
}

/// A growing array of floats on a 32-byte border. Growing loses what was in it.
class LaneArray {
public:
    LaneArray() = default;
    explicit LaneArray(std::size_t count) { resize(count); }
    void resize(std::size_t count) {
        size_ = count;
        if (count <= capacity_) return;
        capacity_ = count + count / 2;
        data_.reset(static_cast<float*>(::operator new[](capacity_ * sizeof(float), std::align_val_t{32})));
        for (std::size_t i = 0; i < capacity_; ++i) data_.get()[i] = 0;
    }
    [[nodiscard]] float* data() noexcept { return data_.get(); }
    [[nodiscard]] const float* data() const noexcept { return data_.get(); }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }

private:
    struct Free {
        void operator()(float* p) const { ::operator delete[](p, std::align_val_t{32}); }
    };
    std::unique_ptr<float[], Free> data_;
    std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace sim
