#pragma once
#include "bytes/fields.h"
#include "sim/modal_body.h"

namespace sim {

// Fields of what scenes and kits have in common.

void fields(auto& archive, Is<Eigen::Quaterniond> auto& q) {
    archive("w x y z", q.w(), q.x(), q.y(), q.z());
}
void fields(auto& archive, Is<Eigen::Isometry3d> auto& pose) {
    archive("rotation translation", pose.linear(), pose.translation());
}
void fields(auto& archive, Is<Superquadric> auto& shape) {
    archive("semi_axes e1 e2", shape.semi_axes, shape.e1, shape.e2);
}
void fields(auto& archive, Is<Material> auto& m) {
    archive("young_pa poisson density_kg_m3", m.young_pa, m.poisson, m.density_kg_m3);
}

}  // namespace sim
