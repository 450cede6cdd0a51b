#pragma once
#include "shape/lanes.h"

namespace sim {

/// Sums and products of the solver's rows: floats in whole lanes, on 32-byte borders, padded with zeros.
[[nodiscard]] inline float dot(const float* a, const float* b, int width) {
    Lanes sum = load_lanes(a) * load_lanes(b);
    for (int i = kLanes; i < width; i += kLanes) sum = fused(load_lanes(a + i), load_lanes(b + i), sum);
    return sum_of(sum);
}

/// Three rows against one vector, added to three sums.
template <int kWidth>
void dot_rows(const float* rows, const float* y, int any_width, Lanes (&sum)[3]) {
    const int width = kWidth ? kWidth : any_width;
    for (int i = 0; i < width; i += kLanes) {
        const Lanes x = load_lanes(y + i);
        for (int r = 0; r < 3; ++r) sum[r] = fused(load_lanes(rows + r * width + i), x, sum[r]);
    }
}

/// y += rows^T p.
template <int kWidth>
void add_rows_to(const float* rows, const float (&p)[3], int any_width, float* y) {
    const int width = kWidth ? kWidth : any_width;
    const Lanes p0 = lanes_of(p[0]), p1 = lanes_of(p[1]), p2 = lanes_of(p[2]);
    for (int i = 0; i < width; i += kLanes)
        store_lanes(y + i, fused(p2, load_lanes(rows + 2 * width + i),
                                 fused(p1, load_lanes(rows + width + i),
                                       fused(p0, load_lanes(rows + i), load_lanes(y + i)))));
}

// The usual widths (9 to 16 modes, rigid, linear) unrolled.
[[gnu::always_inline]] inline void dot_rows(const float* rows, const float* y, int width, Lanes (&sum)[3]) {
    if (width == 24) return dot_rows<24>(rows, y, width, sum);
    if (width == 8) return dot_rows<8>(rows, y, width, sum);
    if (width == 16) return dot_rows<16>(rows, y, width, sum);
    dot_rows<0>(rows, y, width, sum);
}
[[gnu::always_inline]] inline void add_rows_to(const float* rows, const float (&p)[3], int width, float* y) {
    if (width == 24) return add_rows_to<24>(rows, p, width, y);
    if (width == 8) return add_rows_to<8>(rows, p, width, y);
    if (width == 16) return add_rows_to<16>(rows, p, width, y);
    add_rows_to<0>(rows, p, width, y);
}

}  // namespace sim
