#include "obj_mesh.h"

#include <cmath>
#include <cstdio>

namespace meshgen {
namespace {

void append_vector(std::string& out, const char* keyword, const Eigen::Vector3d& v) {
    out += keyword;
    for (const double component : v) {
        char digits[32];
        const double rounded = std::round(component * 1e6) / 1e6;
        std::snprintf(digits, sizeof digits, " %.6f", rounded + 0.0);  // + 0.0 turns -0 into 0
        out += digits;
    }
    out += '\n';
}

void append_face(std::string& out, const std::array<int, 3>& triangle, int base) {
    out += 'f';
    for (const int index : triangle) {
        const std::string number = std::to_string(base + index);
        out += ' ' + number + "//" + number;
    }
    out += '\n';
}

}  // namespace

Part& ObjMesh::part(const std::string& part_name) {
    for (Part& part : parts) {
        if (part.name == part_name) return part;
    }
    parts.push_back({part_name, {}, {}, {}});
    return parts.back();
}

std::string ObjMesh::text() const {
    std::string out = "# Made by musicworld_meshgen; do not edit.\no " + name + "\n";
    int base = 1;
    for (const Part& part : parts) {
        for (const Eigen::Vector3d& position : part.positions) append_vector(out, "v", position);
        for (const Eigen::Vector3d& normal : part.normals) append_vector(out, "vn", normal);
        out += "usemtl " + part.name + "\n";
        for (const std::array<int, 3>& triangle : part.triangles) append_face(out, triangle, base);
        base += static_cast<int>(part.positions.size());
    }
    return out;
}

}  // namespace meshgen
