#include "shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "render/mesh.h"

namespace {

const std::string kAssets = MUSICWORLD_SOURCE_DIR "/assets/meshes/";

using Place = std::array<long, 3>;  // tenths of a micrometre

Place place(const Eigen::Vector3d& v) {
    return {std::lround(v.x() * 1e7), std::lround(v.y() * 1e7), std::lround(v.z() * 1e7)};
}

TEST(Shapes, TheCommittedFilesAreTheGeneratorsOutputByteForByte) {
    for (const meshgen::ObjMesh& mesh : meshgen::all_shapes()) {
        std::ifstream file(kAssets + mesh.name + ".obj", std::ios::binary);
        std::ostringstream bytes;
        bytes << file.rdbuf();
        EXPECT_TRUE(bytes.str() == mesh.text())
            << mesh.name << ".obj differs: build musicworld_meshgen and run it on assets/meshes";
    }
}

TEST(Shapes, EveryPartIsClosedEachEdgeBeingWalkedAsOftenEachWay) {
    for (const meshgen::ObjMesh& mesh : meshgen::all_shapes()) {
        for (const meshgen::Part& part : mesh.parts) {
            std::map<std::pair<Place, Place>, int> walked;
            for (const auto& triangle : part.triangles) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const Place from = place(part.positions[static_cast<std::size_t>(triangle[k])]);
                    const Place to = place(part.positions[static_cast<std::size_t>(triangle[(k + 1) % 3])]);
                    ++walked[{from, to}];
                    --walked[{to, from}];
                }
            }
            for (const auto& [edge, excess] : walked) ASSERT_EQ(excess, 0) << mesh.name << " " << part.name;
        }
    }
}

TEST(Shapes, WindingIsOutwardAndNormalsAgreeWithIt) {
    for (const meshgen::ObjMesh& mesh : meshgen::all_shapes()) {
        for (const meshgen::Part& part : mesh.parts) {
            double six_volumes = 0;
            for (const auto& triangle : part.triangles) {
                const auto corner = [&](std::size_t k) {
                    return part.positions[static_cast<std::size_t>(triangle[k])];
                };
                const Eigen::Vector3d face = (corner(1) - corner(0)).cross(corner(2) - corner(0));
                six_volumes += corner(0).dot(corner(1).cross(corner(2)));
                ASSERT_GT(face.norm(), 1e-10) << mesh.name << " " << part.name << ": a triangle without area";
                for (const int index : triangle) {
                    const Eigen::Vector3d& normal = part.normals[static_cast<std::size_t>(index)];
                    EXPECT_NEAR(normal.norm(), 1, 1e-9);
                    EXPECT_GT(normal.dot(face), 0) << mesh.name << " " << part.name;
                }
            }
            EXPECT_GT(six_volumes, 0) << mesh.name << " " << part.name;
        }
    }
}

TEST(Shapes, TheFilesLoadWithTheirPartsAndStayWithinTheirTriangles) {
    const std::map<std::string, std::set<std::string>> parts = {{"drum", {"shell", "head", "hoop", "lug"}},
                                                                {"cymbal", {"bronze"}},
                                                                {"bell", {"metal"}},
                                                                {"bar", {"bar"}},
                                                                {"string", {"string"}},
                                                                {"string_frame", {"wood"}},
                                                                {"stand", {"metal", "rubber"}},
                                                                {"stick", {"wood", "tip"}},
                                                                {"mallet", {"wood", "tip"}}};
    for (const auto& [name, expected] : parts) {
        const render::Mesh mesh = render::load_mesh(kAssets + name + ".obj");
        std::set<std::string> names;
        for (const render::MeshPart& part : mesh.parts) names.insert(part.material);
        EXPECT_EQ(names, expected);
        EXPECT_LE(mesh.triangles(), name == "drum" ? 2500u : 1500u) << name;
    }
}

TEST(Shapes, InstrumentsFillTheUnitCubeAndNothingMore) {
    constexpr float kText = 1e-6f;  // six decimals
    for (const char* name : {"drum", "cymbal", "bar", "string", "string_frame", "bell"}) {
        const Eigen::AlignedBox3f bounds = render::load_mesh(kAssets + name + ".obj").bounds();
        EXPECT_LE(bounds.max().maxCoeff(), 1 + kText) << name;
        EXPECT_GE(bounds.min().minCoeff(), -1 - kText) << name;
        if (std::string(name) == "bell") continue;  // smaller: it is open below
        EXPECT_GE(bounds.max().minCoeff(), 0.99f) << name;
        EXPECT_LE(bounds.min().maxCoeff(), -0.99f) << name;
    }
}

TEST(Shapes, TheBellsDomeLiesInTheUnitBallSoThatAnEllipsoidIsItsOutline) {
    for (const meshgen::Part& part : meshgen::bell().parts) {
        for (const Eigen::Vector3d& position : part.positions) EXPECT_LE(position.norm(), 1.0);
    }
}

TEST(Shapes, TheBeadsCentreIs40CentimetresBeforeTheHandAndItsRadius6Or20Millimetres) {
    for (const auto& [mesh, radius] : {std::pair{meshgen::stick(), 0.006}, {meshgen::mallet(), 0.020}}) {
        for (const meshgen::Part& part : mesh.parts) {
            if (part.name != "tip") continue;
            for (const Eigen::Vector3d& position : part.positions) {
                EXPECT_NEAR((position - Eigen::Vector3d(0, 0, -0.40)).norm(), radius, 1e-12);
            }
        }
        const render::Mesh loaded = render::load_mesh(kAssets + mesh.name + ".obj");
        EXPECT_NEAR(loaded.bounds().max().z(), 0.06, 1e-6);
        EXPECT_NEAR(loaded.bounds().min().z(), -0.40 - radius, 1e-6);
    }
}

TEST(Shapes, TheStandReachesFromTheOriginToFeetOfRadius25CentimetresOneBelow) {
    const Eigen::AlignedBox3f bounds = render::load_mesh(kAssets + "stand.obj").bounds();
    EXPECT_NEAR(bounds.max().y(), 0, 1e-6);
    EXPECT_NEAR(bounds.min().y(), -1, 1e-6);
    double reach = 0;
    for (const meshgen::Part& part : meshgen::stand().parts) {
        for (const Eigen::Vector3d& p : part.positions) reach = std::max(reach, std::hypot(p.x(), p.z()));
    }
    EXPECT_NEAR(reach, 0.25, 1e-3);  // the feet's ball is a polygon round
}

}  // namespace
