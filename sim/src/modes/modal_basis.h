#pragma once
#include <Eigen/Core>

namespace sim {

/// Turns a basis of one degenerate group (columns orthonormal in the mass) into the canonical one of its
/// span: the group's responses to unit forces on the nodal axes in order, made orthonormal; each column's
/// largest entry (the first of those within 0.1 %) positive.
void make_canonical(Eigen::MatrixXd& span);

}  // namespace sim
