#pragma once
#include "obj_mesh.h"

namespace meshgen {

/// A point (radius, height) of the profile of a surface of revolution about +y.
using ProfilePoint = Eigen::Vector2d;
using Profile = std::vector<ProfilePoint>;

/// Turns a profile about +y. Walked from the top's centre outwards, down, and back to the centre, the outside
/// lies to its left. Smooth along one profile; give an edge as the end of one profile and the start of the
/// next. A radius of 0 becomes a pole.
void lathe(Part& part, const Profile& profile, int segments);
/// The same for a profile that ends where it began (a ring); the last point joins the first.
void lathe_ring(Part& part, const Profile& loop, int segments);
/// Several profiles that meet in edges.
void lathe_with_edges(Part& part, const std::vector<Profile>& profiles, int segments);

/// A closed tube from one point to another with a radius at each end.
void tube(Part& part, const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector2d& radii,
          int segments);
void sphere(Part& part, const Eigen::Vector3d& center, double radius, int segments);
/// A box with rounded edges; rounding is the size of the rounded border on each axis.
void rounded_box(Part& part, const Eigen::Vector3d& center, const Eigen::Vector3d& half,
                 const Eigen::Vector3d& rounding, int arc_steps);

/// Adds the triangles of one part to another, moved; the matrix must keep orientation.
void append_transformed(Part& target, const Part& source, const Eigen::Affine3d& target_from_source);

}  // namespace meshgen
