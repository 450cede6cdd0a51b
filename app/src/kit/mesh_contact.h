#pragma once
#include <render/mesh.h>
#include <sim/superquadric_fit.h>

#include <Eigen/Geometry>
#include <vector>

namespace app {

/// Points of a mesh's outer surface [m, body frame].
struct OuterSurface {
    std::vector<Eigen::Vector3d> points;
    double hollow_m = 0;  ///< depth, below the convex hull, of the deepest point that is left out; 0: none
    bool inside_out = false;  ///< closed, but its faces look inwards: they were turned
};
/// At most 1536: in each direction from the middle of its box (a cell of a cube's face, 16 x 16) the outermost one of
/// those whose surface faces outwards. So the inner side of a hollow body is left out, and so is what lies deeper than
/// a tenth of the body's size below its convex hull (a bell's clapper): bodies that are struck are convex. A mesh whose
/// faces enclose a negative volume is taken as turned. Of 60000 points that lie evenly over the surface, and of the
/// corners. Deterministic.
[[nodiscard]] OuterSurface outer_surface(const render::Mesh& mesh, const Eigen::Affine3d& body_from_mesh);

}  // namespace app
