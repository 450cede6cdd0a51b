#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/geometry.h"

namespace sim {

/// Samples of a rest surface: the points that are tested for contact, and the polygons that are drawn.
/// Poles on the y axis, `meridians` x `parallels` points between them in directions equally spaced in angle
/// on the unit sphere scaled by the semi-axes, each carried to the surface along its ray. Triangles are
/// counter-clockwise seen from outside; there are 2 meridians parallels of them and meridians parallels + 2
/// vertices: 18 x 10 gives the thesis's 360 polygons and 182 vertices, 6 x 4 its 48.
struct SurfaceMesh {
    std::vector<Eigen::Vector3d> vertices;  ///< [m], body frame at rest; the mesh's, then `features` more
    std::vector<Eigen::Vector3d> normals;   ///< outward unit normal of each vertex
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::size_t features = 0;  ///< points without triangles, for contact only: corners, edge and face centres
                               ///< of box-like bodies (either exponent below 0.5), rims of drum-like ones (e1
                               ///< alone), tips of spikes; none where a vertex is already
};

/// The mesh of at least `triangles` triangles whose meridians (an even number) and parallels are near to
/// 18 : 10. Bumps displace along the unit normal of the superquadric; normals are those of the bumped
/// surface. triangles from 48 to 20000; throws std::invalid_argument.
[[nodiscard]] SurfaceMesh surface_mesh(const GeneralizedSuperquadric& shape, int triangles);

}  // namespace sim
