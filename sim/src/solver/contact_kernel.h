#pragma once
#include "solver/island_rows.h"
#include "solver/row_kernels.h"

namespace sim {

/// Square root without the library's check for negative arguments.
[[nodiscard]] inline float root_of(float x) noexcept {
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x)));
}

/// What rows see of the velocities [m/s].
[[gnu::always_inline]] inline void speeds(const IslandRows& island, const Rows& rows, float (&v)[3]) {
    Lanes sum[3] = {lanes_of(0), lanes_of(0), lanes_of(0)};
    for (const RowSide& side : rows.side)
        if (side.body >= 0)
            dot_rows(island.jacobians.data() + side.rows, island.y.data() + side.y, side.width, sum);
    for (int r = 0; r < 3; ++r) v[r] = sum_of(sum[r]) + rows.drift[r];
}

/// Adds an impulse along rows to the velocities [N s].
[[gnu::always_inline]] inline void push_by(IslandRows& island, const Rows& rows, const float (&impulse)[3]) {
    for (const RowSide& side : rows.side)
        if (side.body >= 0)
            add_rows_to(island.jacobians.data() + side.rows, impulse, side.width, island.y.data() + side.y);
}

/// One contact of a sweep of projected Gauss-Seidel: its normal impulse changes by
///   -mass_share (v_n + bias) / K_nn - impulse_share p_n, but p_n >= 0,
/// then friction by its 2 x 2 block, limited to the cone (Coulomb). mass_share 1 and impulse_share 0: firm.
inline void solve_contact(IslandRows& island, ContactRows& c, float bias, float mass_share,
                          float impulse_share) {
    float v[3];
    speeds(island, c, v);
    const float normal = std::max(
        c.impulse[0] - mass_share * c.inverse_normal * (v[0] + bias) - impulse_share * c.impulse[0], 0.f);
    float p[3] = {normal - c.impulse[0], 0, 0};
    c.impulse[0] = normal;
    c.largest = std::max(c.largest, normal);
    v[1] += c.k[0][1] * p[0];
    v[2] += c.k[0][2] * p[0];
    const float stick0 = c.impulse[1] - (c.inverse_tangent[0] * v[1] + c.inverse_tangent[1] * v[2]);
    const float stick1 = c.impulse[2] - (c.inverse_tangent[1] * v[1] + c.inverse_tangent[2] * v[2]);
    // If it slides: against the speed, whatever the masses in either direction, so by one mass for both.
    const float most = c.friction * normal;
    const bool slides = stick0 * stick0 + stick1 * stick1 > most * most;
    const float slide0 = c.impulse[1] - c.slide_mass * v[1], slide1 = c.impulse[2] - c.slide_mass * v[2];
    const float scale = most / std::max(root_of(slide0 * slide0 + slide1 * slide1), 1e-30f);
    const float t0 = slides ? scale * slide0 : stick0, t1 = slides ? scale * slide1 : stick1;
    p[1] = t0 - c.impulse[1], p[2] = t1 - c.impulse[2];
    c.impulse[1] = t0, c.impulse[2] = t1;
    if (p[0] != 0 || p[1] != 0 || p[2] != 0) push_by(island, c, p);
}

}  // namespace sim
