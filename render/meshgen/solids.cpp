#include "solids.h"

#include <cmath>
#include <numbers>

namespace meshgen {
namespace {

constexpr double kPi = std::numbers::pi;

/// Outward normal (radial, up) of the piece from a to b: its direction turned left.
Eigen::Vector2d piece_normal(const ProfilePoint& a, const ProfilePoint& b) {
    return Eigen::Vector2d(a.y() - b.y(), b.x() - a.x()).normalized();
}

std::vector<Eigen::Vector2d> profile_normals(const Profile& profile, bool closed) {
    const std::size_t count = profile.size();
    std::vector<Eigen::Vector2d> normals(count, Eigen::Vector2d::Zero());
    for (std::size_t i = 0; i + 1 < count || (closed && i < count); ++i) {
        const Eigen::Vector2d normal = piece_normal(profile[i], profile[(i + 1) % count]);
        normals[i] += normal;
        normals[(i + 1) % count] += normal;
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (profile[i].x() == 0) normals[i] = Eigen::Vector2d(0, normals[i].y() < 0 ? -1 : 1);
        normals[i].normalize();
    }
    return normals;
}

/// One circle of vertices, or a single one at a pole. Returns the index of its first vertex.
int add_circle(Part& part, const ProfilePoint& at, const Eigen::Vector2d& normal, int segments) {
    const int first = static_cast<int>(part.positions.size());
    for (int j = 0; j < (at.x() == 0 ? 1 : segments); ++j) {
        const double angle = 2 * kPi * j / segments, c = std::cos(angle), s = std::sin(angle);
        part.positions.emplace_back(at.x() * c, at.y(), at.x() * s);
        part.normals.emplace_back(normal.x() * c, normal.y(), normal.x() * s);
    }
    return first;
}

void join_circles(Part& part, int upper, bool upper_pole, int lower, bool lower_pole, int segments) {
    for (int j = 0; j < segments; ++j) {
        const int k = (j + 1) % segments;
        if (!upper_pole) part.triangles.push_back({upper + j, upper + k, lower_pole ? lower : lower + j});
        if (!lower_pole) part.triangles.push_back({lower + j, upper_pole ? upper : upper + k, lower + k});
    }
}

void revolve(Part& part, const Profile& profile, bool closed, int segments) {
    const std::vector<Eigen::Vector2d> normals = profile_normals(profile, closed);
    std::vector<int> circles;
    for (std::size_t i = 0; i < profile.size(); ++i)
        circles.push_back(add_circle(part, profile[i], normals[i], segments));
    for (std::size_t i = 0; i + 1 < profile.size() || (closed && i < profile.size()); ++i) {
        const std::size_t next = (i + 1) % profile.size();
        join_circles(part, circles[i], profile[i].x() == 0, circles[next], profile[next].x() == 0, segments);
    }
}

/// Positions along an axis of a rounded box: an arc, the flat piece, an arc; as pairs (inner box, offset
/// direction in [-1, 1]).
std::vector<double> arc_positions(int arc_steps) {
    std::vector<double> sines;
    for (int i = 0; i <= arc_steps; ++i) sines.push_back(-std::tan(kPi / 4 * (arc_steps - i) / arc_steps));
    for (int i = 0; i <= arc_steps; ++i) sines.push_back(std::tan(kPi / 4 * i / arc_steps));
    return sines;
}

}  // namespace

void lathe(Part& part, const Profile& profile, int segments) {
    revolve(part, profile, false, segments);
}

void lathe_ring(Part& part, const Profile& loop, int segments) {
    revolve(part, loop, true, segments);
}

void lathe_with_edges(Part& part, const std::vector<Profile>& profiles, int segments) {
    for (const Profile& profile : profiles) lathe(part, profile, segments);
}

void tube(Part& part, const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector2d& radii,
          int segments) {
    const double length = (to - from).norm();
    Part upright;
    lathe_with_edges(upright,
                     {{{0, 0}, {radii.x(), 0}},
                      {{radii.x(), 0}, {radii.y(), -length}},
                      {{radii.y(), -length}, {0, -length}}},
                     segments);
    Eigen::Affine3d placed = Eigen::Affine3d::Identity();
    placed.linear() =
        Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitY(), to - from).toRotationMatrix();
    placed.translation() = from;
    append_transformed(part, upright, placed);
}

void sphere(Part& part, const Eigen::Vector3d& center, double radius, int segments) {
    Part ball;
    Profile profile;
    const int rows = segments / 2;
    for (int i = 0; i <= rows; ++i) {
        const double angle = kPi * i / rows;
        profile.emplace_back(i % rows == 0 ? 0 : radius * std::sin(angle), radius * std::cos(angle));
    }
    lathe(ball, profile, segments);
    append_transformed(part, ball, Eigen::Affine3d(Eigen::Translation3d(center)));
}

void rounded_box(Part& part, const Eigen::Vector3d& center, const Eigen::Vector3d& half,
                 const Eigen::Vector3d& rounding, int arc_steps) {
    const std::vector<double> grid = arc_positions(arc_steps);
    const int side = static_cast<int>(grid.size());
    const Eigen::Vector3d inner = half - rounding;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const double sign = face % 2 == 0 ? 1 : -1;
        const int first = static_cast<int>(part.positions.size());
        for (int i = 0; i < side * side; ++i) {
            const int iu = i % side, iv = i / side;
            Eigen::Vector3d direction;
            direction[axis] = sign;
            direction[u] =
                sign * grid[static_cast<std::size_t>(iu)];  // u mirrored on the far face keeps the winding
            direction[v] = grid[static_cast<std::size_t>(iv)];
            direction.normalize();
            Eigen::Vector3d corner;
            corner[axis] = sign * inner[axis];
            corner[u] = (iu <= arc_steps ? -sign : sign) * inner[u];
            corner[v] = (iv <= arc_steps ? -1 : 1) * inner[v];
            part.positions.push_back(center + corner + rounding.cwiseProduct(direction));
            part.normals.push_back(direction.cwiseQuotient(rounding).normalized());
        }
        for (int i = 0; i < (side - 1) * (side - 1); ++i) {
            const int a = first + i / (side - 1) * side + i % (side - 1), b = a + 1, c = a + side, d = c + 1;
            part.triangles.push_back({a, b, d});
            part.triangles.push_back({a, d, c});
        }
    }
}

void append_transformed(Part& target, const Part& source, const Eigen::Affine3d& target_from_source) {
    const int base = static_cast<int>(target.positions.size());
    const Eigen::Matrix3d normal_matrix = target_from_source.linear().inverse().transpose();
    for (std::size_t i = 0; i < source.positions.size(); ++i) {
        target.positions.push_back(target_from_source * source.positions[i]);
        target.normals.push_back((normal_matrix * source.normals[i]).normalized());
    }
    for (const std::array<int, 3>& triangle : source.triangles) {
        target.triangles.push_back({base + triangle[0], base + triangle[1], base + triangle[2]});
    }
}

}  // namespace meshgen
