#pragma once
#include <sim/world.h>

#include <memory>
#include <string>

namespace sim_bench {

/// The same balls in the Bullet library, as it is installed (single precision). One thread, 1/60 s per step,
/// ten solver iterations (its default), nothing is put to sleep. The box is made of btBoxShapes.
enum class BulletKind {
    rigid,    ///< btRigidBody with the btConvexHullShape of the 182 vertices
    spheres,  ///< btRigidBody with a btSphereShape
    reduced  ///< btReducedDeformableBody, 183 nodes, 360 tetrahedra, our own modes at the nodes. These bodies
             ///< collide with the box, not with each other.
};

class BulletWorld {
public:
    /// All bodies must be like the first: one sphere at one fidelity.
    BulletWorld(const sim::WorldDefinition& world, BulletKind kind);
    ~BulletWorld();
    BulletWorld(BulletWorld&&) noexcept;
    BulletWorld& operator=(BulletWorld&&) noexcept;

    void step();
    [[nodiscard]] Eigen::Vector3d position(int body) const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// False where this program was built without Bullet: then BulletWorld throws std::runtime_error.
[[nodiscard]] bool bullet_is_there() noexcept;
[[nodiscard]] std::string bullet_version();

}  // namespace sim_bench
