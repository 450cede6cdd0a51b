#include "sim/surface_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <stdexcept>

#include "modes/linear_body.h"

namespace {

using Eigen::Vector3d;

// By the divergence theorem: positive only if the triangles are counter-clockwise seen from outside.
double enclosed_volume(const sim::SurfaceMesh& mesh) {
    double six = 0;
    for (const auto& [a, b, c] : mesh.triangles)
        six += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
    return six / 6;
}

const sim::Superquadric kMeshedShapes[] = {{{0.5, 0.5, 0.5}, 1, 1},     {{0.2, 0.1, 0.3}, 1, 1},
                                           {{0.2, 0.1, 0.2}, 0.1, 1},   {{0.2, 0.1, 0.3}, 0.1, 0.1},
                                           {{0.1, 0.4, 0.2}, 0.5, 1.5}, {{0.3, 0.3, 0.1}, 1.9, 1.9},
                                           {{0.3, 0.2, 0.1}, 1, 0.2}};

TEST(SurfaceMesh, ThesisMeshesHave360TrianglesOn182VerticesAnd48On26) {
    const sim::SurfaceMesh body = sim::surface_mesh({}, 360), limb = sim::surface_mesh({}, 48);
    EXPECT_EQ(body.triangles.size(), 360u);
    EXPECT_EQ(body.vertices.size(), 182u);
    EXPECT_EQ(body.features, 0u);
    EXPECT_EQ(limb.triangles.size(), 48u);
    EXPECT_EQ(limb.vertices.size(), 26u);
}

TEST(SurfaceMesh, HasAtLeastTheTrianglesAskedForAndAtMostAQuarterMore) {
    for (int triangles = 48; triangles <= 20000; triangles += triangles < 1000 ? 1 : 777) {
        const std::size_t made = sim::surface_mesh({}, triangles).triangles.size();
        ASSERT_GE(made, std::size_t(triangles));
        ASSERT_LE(made, 1.25 * triangles + 16) << triangles;  // meridians are even: a step is 4 parallels
    }
    EXPECT_THROW(sim::surface_mesh({}, 47), std::invalid_argument);
    EXPECT_THROW(sim::surface_mesh({}, 20001), std::invalid_argument);
}

TEST(SurfaceMesh, EveryEdgeIsSharedByTwoTrianglesOfOppositeSense) {
    for (const int triangles : {48, 360, 1000}) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        const sim::SurfaceMesh mesh = sim::surface_mesh({}, triangles);
        for (const auto& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, 1);
            EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
        }
        EXPECT_EQ(mesh.vertices.size() - mesh.features + mesh.triangles.size() - edges.size() / 2, 2u);
    }
}

TEST(SurfaceMesh, EnclosedVolumeTendsToTheClosedFormAsTheMeshGetsFiner) {
    for (const sim::Superquadric& shape : kMeshedShapes) {
        const double exact = sim::volume_moments(sim::Gauge(shape)).volume;
        const double coarse = enclosed_volume(sim::surface_mesh({shape, {}}, 360)) / exact;
        const double fine = enclosed_volume(sim::surface_mesh({shape, {}}, 20000)) / exact;
        // Chords of a convex body: less than the whole. Pieces of 20 degrees cut 4 % of a sphere, and more of
        // edges that no vertex hits; pieces of 2.7 degrees a seventh (of edges) to a fiftieth (round) of
        // that.
        EXPECT_LT(coarse, fine);
        EXPECT_GT(coarse, 0.85) << shape.e1 << ' ' << shape.e2;
        EXPECT_NEAR(fine, 1, 0.02) << shape.e1 << ' ' << shape.e2;
        EXPECT_LT(fine, 1 + 1e-9);
    }
}

TEST(SurfaceMesh, VerticesAndFeaturesLieOnTheSurfaceWithItsOutwardNormals) {
    for (const sim::Superquadric& shape : kMeshedShapes) {
        const sim::Gauge gauge(shape);
        const sim::SurfaceMesh mesh = sim::surface_mesh({shape, {}}, 360);
        ASSERT_EQ(mesh.normals.size(), mesh.vertices.size());
        for (std::size_t k = 0; k < mesh.vertices.size(); ++k) {
            EXPECT_NEAR(gauge.value(mesh.vertices[k]), 1, 1e-12);
            EXPECT_NEAR(mesh.normals[k].norm(), 1, 1e-12);
            EXPECT_GT(mesh.normals[k].dot(mesh.vertices[k]), 0);
            EXPECT_LT(gauge.value(mesh.vertices[k] - 1e-4 * mesh.normals[k]), 1);
        }
    }
}

TEST(SurfaceMesh, BoxesHaveTheirEightCornersAndDrumsTheirRimsAmongTheFeatures) {
    const auto nearest = [](const sim::SurfaceMesh& mesh, const Vector3d& place) {
        double least = 1e9;
        for (const Vector3d& v : mesh.vertices) least = std::min(least, (v - place).norm());
        return least;
    };
    const sim::SurfaceMesh box = sim::surface_mesh({{{0.2, 0.1, 0.3}, 0.1, 0.1}, {}}, 48);
    // The corner of the cross-section is 2^(-e2/2) of the way out, that of the profile 2^(-e1/2).
    const double flat = std::pow(2, -0.05), high = flat;
    for (int k = 0; k < 8; ++k) {
        const Vector3d corner(k & 1 ? 0.2 : -0.2, k & 2 ? 0.1 : -0.1, k & 4 ? 0.3 : -0.3);
        EXPECT_LT(nearest(box, corner.cwiseProduct(Vector3d(flat * high, high, flat * high))), 1e-9);
    }
    EXPECT_EQ(sim::surface_mesh({{{0.2, 0.1, 0.3}, 0.5, 0.5}, {}}, 48).features, 0u);

    const sim::SurfaceMesh drum = sim::surface_mesh({{{0.2, 0.1, 0.2}, 0.1, 1}, {}}, 360);
    for (int k = 0; k < 18; ++k) {
        const double phi = 2 * M_PI * k / 18, rim = std::pow(2, -0.05);
        EXPECT_LT(nearest(drum, rim * Vector3d(0.2 * std::cos(phi), 0.1, 0.2 * std::sin(phi))), 1e-9);
    }
}

TEST(SurfaceMesh, ASpikeOf20CmReaches20CmBeyondTheSphereAndItsTipIsAVertex) {
    const Vector3d direction(1, 2, 0.5);
    const sim::GeneralizedSuperquadric spiked{{{0.5, 0.5, 0.5}, 1, 1}, {{direction, 0.2, 0.3}}};
    const sim::SurfaceMesh mesh = sim::surface_mesh(spiked, 360);
    ASSERT_EQ(mesh.features, 1u);
    EXPECT_LT((mesh.vertices.back() - 0.7 * direction.normalized()).norm(), 1e-12);
    EXPECT_LT((mesh.normals.back() - direction.normalized()).norm(), 1e-9);
    for (const Vector3d& v : mesh.vertices) {
        const double angle = std::acos(std::min(1.0, v.normalized().dot(direction.normalized())));
        EXPECT_NEAR(v.norm(), 0.5 + 0.2 * std::exp(-std::pow(angle / 0.3, 2)), 1e-12);
    }
}

// The mean of the triangles about a vertex, weighted by their angles there.
Vector3d normal_by_triangles(const sim::SurfaceMesh& mesh, std::uint32_t vertex) {
    Vector3d sum = Vector3d::Zero();
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
            if (t[k] != vertex) continue;
            const Vector3d a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[vertex];
            const Vector3d b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[vertex];
            sum += std::atan2(a.cross(b).norm(), a.dot(b)) * a.cross(b).normalized();
        }
    }
    return sum.normalized();
}

TEST(SurfaceMesh, NormalsOfSpikesAndDentsAgreeWithTheTrianglesOfAFineMesh) {
    const sim::GeneralizedSuperquadric shape{
        {{0.5, 0.3, 0.4}, 0.8, 1.2}, {{Vector3d(1, 1, 1), 0.15, 0.4}, {Vector3d(-1, 0.2, 0), -0.1, 0.5}}};
    const sim::SurfaceMesh mesh = sim::surface_mesh(shape, 20000);
    double worst = 0, tilted = 0;
    for (std::uint32_t k = 0; k < mesh.vertices.size() - mesh.features; ++k) {
        const Vector3d& r = mesh.vertices[k];
        // Kinks of e2 > 1 (planes x = 0, z = 0) have no normal, and the parallels shrink at the poles.
        if (std::min(std::abs(r.x()), std::abs(r.z())) < 0.03) continue;
        worst = std::max(worst, (mesh.normals[k] - normal_by_triangles(mesh, k)).norm());
        const sim::Gauge gauge(shape.base);
        tilted = std::max(tilted, (mesh.normals[k] - gauge.derivatives(r).gradient.normalized()).norm());
    }
    EXPECT_LT(worst, 0.03);  // facets of 2.7 degrees on surfaces that bend three times as fast as the rays
    EXPECT_GT(tilted, 0.4);  // without the spike's own slope they would be this far off
}

}  // namespace
