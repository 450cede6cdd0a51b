#pragma once
#include "render/mesh.h"

namespace render {

/// Normals of a part that a file gives none: at a corner of a triangle the mean of the normals of all triangles there that
/// lie within kCrease of its own, each weighted by its angle at the corner (Thurmer and Wuthrich, "Computing vertex normals
/// from polygonal facets", 1998). So a sphere is smooth and a cube has edges, however its file shares vertices. Corners of
/// equal place and normal become one vertex.
void make_normals(MeshPart& part);

inline constexpr float kCreaseDeg = 45;

}  // namespace render
