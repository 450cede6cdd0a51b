#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sim/distributed_world.h"

namespace sim {

/// What keeps the surface of a body from the continuum's, estimated, as shares of its largest extent.
struct BodyError {
    double mesh = 0;        ///< finite elements against their limit
    double truncation = 0;  ///< compliance of the modes that are left out, under the loads that acted
    double linearity = 0;   ///< large deformations against modes that add up
    double sampling = 0;    ///< sagitta: how far the surface bulges between the samples that touch
    double step = 0;        ///< length of a step: by how much paths change when it is halved
    double loaded_s = 0;    ///< when the load acted that all but the step's are of
    [[nodiscard]] double total() const noexcept { return mesh + truncation + linearity + sampling + step; }
};

struct AccuracyRequest {
    double accuracy = 0.01;   ///< share of each body's largest extent
    std::uint64_t steps = 0;  ///< of the scene's dt
    bool until_rest = false;  ///< as DistributedSettings
    bool keep_step = false;   ///< dt stays as it is
};

struct AccuracyReport {
    double accuracy = 0;  ///< that was asked for
    int step_parts = 1;   ///< the scene's dt was divided by this
    int trials = 0;       ///< runs that the choice took
    std::vector<BodyError> bodies;
    /// From here on paths that differ by the step alone lie further apart than asked, in some body; none: never.
    std::optional<double> parted_s;
    int parted_body = -1;  ///< the first of those
};

/// Chooses how a scene is computed so that every body's surface lies within `accuracy` of its largest extent (root
/// mean square over the surface) of the continuum's: the same shapes of linear elastic matter with the scene's
/// damping, friction and restitution, meshed, sampled and stepped without end. Up to and through each of a body's
/// contacts: rebounds part paths afterwards. Changes `scene`: `fidelity`, `modes`, `elements`, `triangles` and
/// `restitution` of bodies that are automatic and move by forces, dt, and the numbers of events' steps with it.
///
/// 1. A trial with rigid bodies finds what presses on each body where: impacts' speeds, forces that last.
/// 2. All automatic bodies of one shape and material take the cheapest way whose mesh, truncation (ContactCompliance) and
///    sampling under these loads err, with 3 (u / extent)^2 for large displacements u, by at most 0.7 of what is
///    allowed; if none does, the cheapest near the best (1.3 times). Where an impact is too short for any step the
///    body is rigid; a rigid one rebounds by what its modes' damping leaves (at least by its restitution).
/// 3. dt is halved, up to three times for short impacts before trials are compared and up to kMostHalvings times
///    from there on (8 in all), until halving it moves no body's surface by more than what is left; the error of
///    the finer of two trials is taken to be their difference, of the coarser twice that (order 1). Halving ends
///    early where it no longer brings trials together: in scenes that are chaotic, or whose contacts switch,
///    nothing keeps paths together.
/// 4. Loads of the last trial, and the first's, go into what is reported: an estimate above what was asked says
///    which part of it errs, where no choice sufficed or loads grew.
///
/// Estimates leave out bumps and what a contact's error does to the next contacts. Bodies that events add are chosen
/// for like the others. Trials run in this process, of the whole time, one after another: three to seven, about three
/// times the cost of the run itself, and 0.15 s for each shape and material. Deterministic. `progress` gets
/// each trial's share done. Throws as run_alone.
AccuracyReport keep_accuracy(WorldScene& scene, const AccuracyRequest& request,
                             const std::function<void(double)>& progress = {});

constexpr int kMostHalvings = 5;

/// How far the centrifugal load of a body's spin, which worlds leave out, would stretch it: at most this share of its
/// largest extent. A bar of half length a that turns end over end is under the stress rho w^2 (a^2 - x^2) / 2 and grows
/// by u = rho w^2 a^3 / (3 E) at either end, so by u / a = rho w^2 a^2 / (3 E) = pi^2 / 12 (w / w_1)^2 with its lowest
/// stretching mode's w_1 = pi / (2 a) sqrt(E / rho). Others yield less, about any axis and as they tumble: a ball 0.57
/// times as much, but a square plate's edge 1.02 times.
[[nodiscard]] double centrifugal_stretch(const World& world, int body);

}  // namespace sim
