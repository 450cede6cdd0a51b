#pragma once
#include <rigid_peer.h>
#include <sim/world.h>

#include <optional>
#include <string>
#include <vector>

namespace app {

/// What is right in a hard scene.
enum class Right {
    rests,         ///< bodies stay where they begin
    lands,         ///< at the end each centre is `value` m high
    flies,         ///< straight on, at the speed of the start
    stops,         ///< at the end bodies are at x = `value` m
    rolls,         ///< a ball down the plane, without slip
    keeps_energy,  ///< it neither grows nor shrinks
    gains_none     ///< energy does not grow
};

/// A bundled scene (assets/scenes/hard) and how it is judged.
struct HardScene {
    std::string name;
    Right right;
    double limit;      ///< of the error, see HardFigures
    double value = 0;  ///< see Right
};
[[nodiscard]] const std::vector<HardScene>& hard_scenes();

/// What a run did. Lengths are shares of the size: the largest extent of the smallest body that moves. Energies
/// are shares of what there is: the kinetic energy of the start, and what a fall of every body by its reach
/// frees (its distance from the first place that anything hangs from, else its height above the lowest plane,
/// at least its extent).
struct HardFigures {
    int through =
        0;  ///< bodies whose centre crossed the inner half of another one within a step, both straight and
            ///< on the paths that the velocities make likely, or went beneath a plane
    int quarantined = 0;  ///< taken out or no longer finite; of a library that began anew: all
    int thrown =
        0;  ///< bodies that end farther than the size from where they belong, or were faster than all
            ///< the scene's energy could make them
    double penetration = 0, penetration_at_end = 0;  ///< deepest of any pair, at the end of any step
    std::optional<double> drift;  ///< from where bodies belong: at the end (lands, stops), else the largest
    std::optional<double> joint_gap;  ///< largest distance of two points that a constraint joins
    double energy_gained = 0;         ///< largest, above the start's
    double error = 0;                 ///< drift; rolls: of the way at the end; energy: largest departure
    bool right = false;  ///< error (gains_none: energy_gained) within the limit, none of the first three
};

/// Of all bodies of our world. A body's rotation is that of its rest shape with the same angular momentum.
[[nodiscard]] std::vector<sim_bench::RigidState> rigid_states(const sim::World& world);

/// Judges a run by its states, whoever computed them. Spheres and boxes are taken as such, see peer_shape;
/// other bodies by their boxes.
class HardWatch {
public:
    HardWatch(const sim::WorldDefinition& world, const HardScene& scene);

    /// After each step, at `time_s`. `energy`: the total, where the world knows it better than by its rigid
    /// states. False: some body is not finite, and nothing more can be learnt.
    [[nodiscard]] bool look(double time_s, const std::vector<sim_bench::RigidState>& states,
                            std::optional<double> energy = {});
    /// After the last step. `quarantined`: as the world counts it.
    [[nodiscard]] HardFigures figures(int quarantined) const;

private:
    [[nodiscard]] bool moves(std::size_t body) const { return !world_.bodies[body].fixed; }
    [[nodiscard]] double energy_of(const std::vector<sim_bench::RigidState>& states) const;
    [[nodiscard]] double reach(std::size_t body) const;
    [[nodiscard]] double depth(std::size_t a, std::size_t b,
                               const std::vector<sim_bench::RigidState>& s) const;
    [[nodiscard]] Eigen::Vector3d place(std::size_t body) const;
    void find_penetration(const std::vector<sim_bench::RigidState>& states);
    void find_through(const std::vector<sim_bench::RigidState>& states, double dt);
    void find_gaps(const std::vector<sim_bench::RigidState>& states);
    void find_drift(const std::vector<sim_bench::RigidState>& states);

    const sim::WorldDefinition& world_;
    HardScene scene_;
    std::vector<sim::RigidMass> masses_;
    std::vector<sim_bench::RigidState> start_, before_;
    std::vector<bool> joined_, through_, thrown_, away_;
    double size_ = 0, scale_ = 0, energy_ = 0, departure_ = 0, time_s_ = 0, rolled_ = 0;
    int lost_ = 0;  ///< bodies that were not finite
    HardFigures seen_;
};

}  // namespace app
