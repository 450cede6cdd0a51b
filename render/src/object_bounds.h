#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "render/mesh.h"
#include "render/scene.h"

namespace render {

/// Corners of a convex body around all of a mesh: what 26 planes, across the axes and the diagonals of its box, cut out
/// (Klosowski et al. 1998, "k-DOPs"), a little more. About a drum it is an eighth smaller than the box. Without
/// a thickness: the box's.
[[nodiscard]] std::vector<Eigen::Vector3f> corners_around(const Mesh& mesh);

/// What an object's vertices lie within, in its own frame: the hull of `corners`; of one that bends, a box, grown by
/// |q_k| times `reach[k]` when mode k has the coordinate q_k.
struct ObjectBounds {
    Eigen::AlignedBox3f box;
    std::vector<Eigen::Vector3f> reach;
    std::vector<Eigen::Vector3f> corners;
    Shadow shadow = Shadow::cast;

    [[nodiscard]] std::vector<Eigen::Vector3f> corners_now(const FrameState& frame, std::size_t object) const;
};

}  // namespace render
