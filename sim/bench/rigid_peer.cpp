#include "rigid_peer.h"

#include <sim/surface_mesh.h>

namespace sim_bench {

std::vector<PeerLibrary> rigid_peers() {
    std::vector<PeerLibrary> peers;
    add_bullet(peers);
    add_mujoco(peers);
    return peers;
}

PeerShape peer_shape(const sim::WorldBody& body, bool hulls) {
    const sim::Superquadric& s = body.shape.base;
    if (hulls || !body.shape.bumps.empty()) return PeerShape::hull;
    if (s.e1 == 1 && s.e2 == 1 && s.semi_axes.minCoeff() == s.semi_axes.maxCoeff()) return PeerShape::sphere;
    return s.e1 <= 0.2 && s.e2 <= 0.2 ? PeerShape::box : PeerShape::hull;
}

std::vector<Eigen::Vector3d> hull_points(const sim::WorldBody& body) {
    return sim::surface_mesh(body.shape, body.triangles).vertices;
}

}  // namespace sim_bench
