#pragma once
#include <sim/world.h>

#include <memory>
#include <string>
#include <vector>

namespace sim_bench {

/// Exact state of a rigid body. World axes, SI.
struct RigidState {
    Eigen::Vector3d position;          ///< of the centre of mass [m]
    Eigen::Quaterniond orientation;    ///< body to world
    Eigen::Vector3d velocity;          ///< [m/s]
    Eigen::Vector3d angular_velocity;  ///< [rad/s]
};

/// How a peer computes a world.
struct PeerSettings {
    double dt = 1.0 / 60;
    bool sleeping = false;
    bool hulls = false;  ///< hulls of our samples, also where the peer has spheres and boxes of its own
    std::string method;  ///< one of PeerLibrary::methods
    int contacts_per_body = 20;  ///< room for them, where a peer needs to know
};

/// The bodies of a world, all of them rigid, in another library. Superquadrics of exponents 1 are spheres if
/// their axes are equal, those of exponents up to 0.2 boxes; all others hulls. Constraints are joints of no
/// extent, without a spring; the bodies that they join do not touch. One thread.
class RigidPeer {
public:
    virtual ~RigidPeer() = default;
    virtual void step() = 0;
    /// After the last step; slow, not to be timed.
    [[nodiscard]] virtual std::vector<RigidState> states() = 0;
    /// False once the library has given the state up and begun anew.
    [[nodiscard]] virtual bool whole() const { return true; }
};

/// A library that this program may have been built with.
struct PeerLibrary {
    std::string name, version;
    bool sleeps = false;               ///< it can put bodies to sleep
    std::vector<std::string> methods;  ///< of solving or integrating; the first is the library's own choice
    std::string settings;              ///< what else was chosen, for a reader
    std::unique_ptr<RigidPeer> (*make)(const sim::WorldDefinition& world, const PeerSettings& settings);
};

/// The peers whose libraries are installed.
[[nodiscard]] std::vector<PeerLibrary> rigid_peers();

// One file for each library, or one without it, which returns false.
bool add_bullet(std::vector<PeerLibrary>& peers);
bool add_mujoco(std::vector<PeerLibrary>& peers);

/// What a peer makes of a body.
enum class PeerShape { sphere, box, hull };
[[nodiscard]] PeerShape peer_shape(const sim::WorldBody& body, bool hulls);
/// The samples of a body's surface, body frame [m].
[[nodiscard]] std::vector<Eigen::Vector3d> hull_points(const sim::WorldBody& body);

}  // namespace sim_bench
