#include "solver/restitution.h"

#include <cmath>

#include "solver/contact_kernel.h"

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// [m/s] Slower approaches may be those of what rests, so they never rebound, whatever the step. Without: in long steps or under a
// heavy pull the limit by weight alone would stop all slow rebounds.
constexpr double kFastestRest = 0.1;
// Substeps in which weight may bring a resting body to the speed at which it does not rebound yet. Without: what rests on
// something that gives way hops.
constexpr double kRestSubsteps = 4;

}  // namespace

// Approaches up to this one do not rebound: those that weight brings about within a few substeps [m/s].
float least_bounce(const IslandRows& rows, const ContactRows& c) {
    const Eigen::Vector3d& g = rows.settings.gravity;
    const double h = rows.settings.dt / rows.settings.substeps,
                 along = std::abs(g.dot(c.point->normal.cast<double>())) + 0.1 * g.norm();
    return static_cast<float>(std::min(kFastestRest, kRestSubsteps * h * along));
}

// The speed that an impact leaves: e times the approach; of bodies with modes, what leaves e^2 of the energy that stopping
// them takes, K / 2 of the rigid part for a unit of impulse.
void aim(const IslandRows& rows, ContactRows& c) {
    c.bias = 0;
    const float e = c.approach < -least_bounce(rows, c) ? c.manifold->restitution : 0;
    if (e == 0) return;
    float rigid = 0;
    for (const RowSide& side : c.side)
        if (side.body >= 0)
            rigid += dot(rows.jacobians.data() + side.rows, rows.jacobians.data() + side.rows, 8);
    const float whole = std::max(c.k[0][0], rigid), firm = 2 * whole - rigid;
    c.bias = c.approach * ((whole + std::sqrt(whole * whole - firm * rigid * (1 - e * e))) / firm - 1);
}

void note_work(const IslandRows& rows, ContactRows& c, float impulse) {
    if (c.restitution == 0 || c.largest == 0) return;
    float mean = c.drift[0];
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const float* d = rows.jacobians.data() + side.rows;
        const float *before = rows.start.data() + side.y, *after = rows.y.data() + side.y;
        mean += (dot(d, before, 8) + dot(d, after, 8)) / 2;
        if (side.width > 8) mean += dot(d + 8, after + 8, side.width - 8);
    }
    c.taken -= impulse * mean;
}

void restitute(IslandRows& rows, ContactRows& c) {
    if (c.restitution == 0 || c.largest == 0 || c.approach >= -least_bounce(rows, c)) return;
    if (!rows.directly && rows.is_rigid(c)) return;  // impacts did
    rows.cross.note_rebound(c);
    float v[3];
    speeds(rows, c, v);
    float rigid = 0, slope = v[0];
    for (const RowSide& side : c.side) {
        if (side.body < 0) continue;
        const float *d = rows.jacobians.data() + side.rows, *y = rows.y.data() + side.y,
                    *start = rows.start.data() + side.y;
        rigid += dot(d, d, 8);
        // The modes yield to p under all impulses of this substep, too.
        if (side.width > 8)
            slope += dot(d + 8, y + 8, side.width - 8) - dot(d + 8, start + 8, side.width - 8);
    }
    const float modes = c.k[0][0] - rigid, firm = rigid / 2 + modes;
    const float budget = c.restitution * c.restitution * std::max(c.taken, 0.f);
    const float most = (std::sqrt(slope * slope + 4 * firm * budget) - slope) / (2 * firm);
    const float wanted = -c.inverse_normal * (v[0] + c.restitution * c.approach);
    const float p[3] = {std::clamp(wanted, 0.f, std::max(most, 0.f)), 0, 0};
    c.impulse[0] += p[0];
    push_by(rows, c, p);
}

}  // namespace sim
