#include "mesh_stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace {

render::Mesh two_triangles() {
    render::MeshPart part{"skin",
                          {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
                          std::vector<Eigen::Vector3f>(4, Eigen::Vector3f::UnitZ()),
                          {0, 1, 2, 2, 1, 3}};
    return {{part, {"empty", {}, {}, {}}}};
}

std::string error_of(const render::Mesh& mesh) {
    try {
        (void)render::decode_mesh_stream(render::encode_mesh_stream(mesh));
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(MeshStream, KeepsNamesPositionsNormalsAndIndices) {
    const render::Mesh mesh = two_triangles();
    const render::Mesh back = render::decode_mesh_stream(render::encode_mesh_stream(mesh));
    ASSERT_EQ(back.parts.size(), 2u);
    EXPECT_EQ(back.parts[0].material, "skin");
    EXPECT_EQ(back.parts[0].positions, mesh.parts[0].positions);
    EXPECT_EQ(back.parts[0].normals, mesh.parts[0].normals);
    EXPECT_EQ(back.parts[0].indices, mesh.parts[0].indices);
    EXPECT_EQ(back.triangles(), 2u);
}

TEST(MeshStream, RefusesValuesThatAreNotFiniteIndicesOutOfRangeAndMeshesWithoutTriangles) {
    render::Mesh mesh = two_triangles();
    mesh.parts[0].positions[1].y() = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(error_of(mesh).find("not finite"), std::string::npos);
    mesh = two_triangles();
    mesh.parts[0].positions[1].y() = 2e5f;
    EXPECT_NE(error_of(mesh).find("beyond 100000 m"), std::string::npos);
    mesh = two_triangles();
    mesh.parts[0].normals[0] = Eigen::Vector3f::Zero();
    EXPECT_NE(error_of(mesh).find("unit length"), std::string::npos);
    mesh = two_triangles();
    mesh.parts[0].indices[5] = 4;
    EXPECT_EQ(error_of(mesh), "found vertex index 4, expected less than 4");
    mesh = two_triangles();
    mesh.parts[0].indices.clear();
    EXPECT_EQ(error_of(mesh), "found no triangles, expected 1 to 500000");
}

TEST(MeshStream, AFailureIsReportedAsOnePrintableLine) {
    try {
        (void)render::decode_mesh_stream(
            render::encode_mesh_failure("found a\nb\x01"
                                        "c, expected d\n"));
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "found a b c, expected d");
    }
}

TEST(MeshStream, TwentyThousandDamagedStreamsEndInAnErrorOrASoundMesh) {
    const std::string sound = render::encode_mesh_stream(two_triangles());
    std::mt19937 random(5);
    for (int round = 0; round < 20000; ++round) {
        std::string bytes = sound;
        for (unsigned change = 0; change <= random() % 3; ++change)
            bytes[random() % bytes.size()] = static_cast<char>(random());
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        try {
            const render::Mesh mesh = render::decode_mesh_stream(bytes);
            for (const render::MeshPart& part : mesh.parts) {
                for (const Eigen::Vector3f& position : part.positions) ASSERT_TRUE(position.allFinite());
                for (const std::uint32_t index : part.indices) ASSERT_LT(index, part.positions.size());
            }
        } catch (const std::runtime_error&) {  // expected for most
        }
    }
}

}  // namespace
