#pragma once
#include <rigid_peer.h>
#include <sim/world.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// How deep balls of one size lie in each other and in planes: the mean over the pairs that overlap at all, along the
/// line of centres or the plane's normal, as a share of the diameter; 0 without any. Of our World the surfaces are
/// taken where their modes have moved them, to first order: balls that sag do not overlap by that.
[[nodiscard]] double mean_overlap(const sim::WorldDefinition& definition, const sim::World& world);
[[nodiscard]] double mean_overlap(const sim::WorldDefinition& definition,
                                  const std::vector<sim_bench::RigidState>& states);

/// Steps at the end of a run over which overlaps are averaged, of 1/60 s.
inline constexpr int kRestSteps = 60;

/// A library's cheapest setting whose balls overlap at rest no more than they may.
struct EqualPeer {
    sim_bench::PeerLibrary peer;
    sim_bench::PeerSettings settings;
    int halvings = 0;    ///< of the step
    double overlap = 0;  ///< mean at rest

    /// Runs on by one undivided step at a time.
    [[nodiscard]] std::unique_ptr<sim_bench::RigidPeer> start(const sim::WorldDefinition& world) const;
    [[nodiscard]] std::string words() const;  ///< method and step
};

/// Of the library's methods, with balls as spheres and without sleeping: each runs `steps` undivided steps, its step
/// halved, four times at most, until its balls overlap by `most` or less; a run that takes more than `longest_s`
/// of processor time is given up. Empty: no setting does.
[[nodiscard]] std::optional<EqualPeer> cheapest_equal(const sim_bench::PeerLibrary& library,
                                                      const sim::WorldDefinition& world, int steps,
                                                      double most, double longest_s = 30);

}  // namespace app
