#pragma once
#include "solver/island_rows.h"

namespace sim {

// What contacts give back of what they took: at most e^2 of the energy.

/// Approaches up to this one do not rebound: those that weight brings about within a few substeps [m/s].
[[nodiscard]] float least_bounce(const IslandRows& rows, const ContactRows& contact);
/// Sets `bias` to the speed that an impact leaves: e times the approach; of bodies with modes, what leaves e^2 of the energy
/// that stopping them takes, K / 2 of the rigid part for a unit of impulse.
void aim(const IslandRows& rows, ContactRows& contact);
/// Adds to `taken` what a normal impulse takes out in this substep, where the contact may have to give some back: held over
/// the substep, it does p (v0 + v1) / 2 on the rigid part and p G on the modes.
void note_work(const IslandRows& rows, ContactRows& contact, float impulse);
/// A rebound to e times the approach, by an impulse p whose work p v + p^2 (K_rigid / 2 + K_modes) is at most e^2 of the
/// energy that the contact has taken. For rigid bodies both say the same.
void restitute(IslandRows& rows, ContactRows& contact);

}  // namespace sim
