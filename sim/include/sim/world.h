#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "sim/world_state.h"

namespace sim {

/// Many modal bodies that fall, touch, deform and hang together (thesis 2.2, 2.3.1, 2.6). See world.cpp and
/// the folder's README for the method. Called by one thread at a time. A step's result is a pure function of the
/// definition and the calls before it.
class World {
public:
    /// Throws std::invalid_argument naming the body or constraint, the value and what was expected.
    explicit World(const WorldDefinition& definition);
    ~World();
    World(World&&) noexcept;
    World& operator=(World&&) noexcept;

    void step();  ///< by settings().dt; allocates nothing once its buffers have grown
    /// So many threads share out the world's steps, at first one: this one and helpers that sleep between steps. No result
    /// depends on how many. Throws std::invalid_argument below 1.
    void use_threads(int threads);

    /// Ids are indices, never used again.
    int add_body(const WorldBody& body);
    int add_constraint(const PointConstraint& constraint);
    void remove_constraint(int id);                     ///< wakes its bodies
    [[nodiscard]] bool constraint_holds(int id) const;  ///< neither removed nor broken

    [[nodiscard]] const WorldSettings& settings() const noexcept;  ///< as constructed
    [[nodiscard]] int bodies() const noexcept;                     ///< number, quarantined ones included
    [[nodiscard]] const WorldBody& definition(int body) const;     ///< as added
    [[nodiscard]] FidelityChoice fidelity(int body) const;         ///< as used; rigid, linear or modal
    [[nodiscard]] RigidMass rigid_mass(int body) const;            ///< of the rest shape
    [[nodiscard]] const ModalBasis& basis(int body) const;         ///< no modes for a rigid body
    [[nodiscard]] WorldBodyState state(int body) const;            ///< at the end of the last step
    void set_state(int body, const WorldBodyState& state);         ///< wakes it; sizes of q must match
    void apply_force(int body, const Eigen::Vector3d& force,
                     const Eigen::Vector3d& point_body);  ///< [N],
                                                          ///< world axes, at a rest point, for the next step
    void wake(int body);                                  ///< and the bodies that fell asleep with it
    [[nodiscard]] bool asleep(int body) const;
    [[nodiscard]] bool all_asleep() const;         ///< fixed and quarantined bodies count as asleep
    [[nodiscard]] double time_s() const noexcept;  ///< steps done times dt

    struct Energy {
        double kinetic, potential, elastic, springs;  ///< [J]; potential of gravity against the origin
        [[nodiscard]] double total() const { return kinetic + potential + elastic + springs; }
    };
    [[nodiscard]] Energy energy() const;                       ///< of bodies that move
    [[nodiscard]] Eigen::Vector3d momentum() const;            ///< of bodies that are not fixed [kg m/s]
    [[nodiscard]] Eigen::Vector3d angular_momentum() const;    ///< about the origin [kg m^2/s]
    [[nodiscard]] const WorldCounts& counts() const noexcept;  ///< so far
    [[nodiscard]] const std::vector<QuarantinedBody>& quarantined() const noexcept;  ///< in order of steps
    /// Own bodies whose deformation was held at its limit, and constraints that broke by their breaking force
    /// where they were solved; in order of steps, each once. rewind takes back what it undoes.
    [[nodiscard]] const std::vector<FirstStep>& limited() const noexcept;
    [[nodiscard]] const std::vector<FirstStep>& broken() const noexcept;
    /// All impulse that came from planes, fixed bodies, places, gravity, drag, user forces and falling asleep onto own bodies
    /// since the start [kg m/s].
    [[nodiscard]] Eigen::Vector3d outside_impulse() const;

    [[nodiscard]] WorldSnapshot snapshot() const;
    void rewind(const WorldSnapshot& snapshot);  ///< bodies added later stay as they are
    void recall(const WorldPast& past);          ///< after rewind to a snapshot of another world: its past

    /// FNV-1a 64 over the exact states in order of bodies, little-endian doubles.
    [[nodiscard]] std::uint64_t state_hash() const;

protected:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace sim
