#pragma once
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

namespace meshgen {

/// Triangles of one named material. Counter-clockwise seen from outside; shared vertices have shared (smooth)
/// normals.
struct Part {
    std::string name;
    std::vector<Eigen::Vector3d> positions, normals;
    std::vector<std::array<int, 3>> triangles;
};

struct ObjMesh {
    std::string name;
    std::vector<Part> parts;

    /// The part of this name, made on first use. Valid until another part is made.
    Part& part(const std::string& part_name);
    /// The file: v, vn, usemtl and f lines with six decimals, the same bytes on every run.
    [[nodiscard]] std::string text() const;
};

}  // namespace meshgen
