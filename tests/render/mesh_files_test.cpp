#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <stdexcept>

#include "render/mesh.h"
#include "temporary_folder.h"

namespace {

const std::string kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    "usemtl slope\nf 2 3 4\nusemtl walls\nf 1 3 2\nf 1 4 3\nf 1 2 4\n";

template <typename Value>
void append(std::string& bytes, Value value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// The tetrahedron as binary STL: 80 bytes, count, then a normal, three corners and two bytes each.
std::string tetrahedron_stl() {
    const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const float normals[4][3] = {{0.57735f, 0.57735f, 0.57735f}, {0, 0, -1}, {-1, 0, 0}, {0, -1, 0}};
    const int faces[4][3] = {{1, 2, 3}, {0, 2, 1}, {0, 3, 2}, {0, 1, 3}};
    std::string bytes(80, ' ');
    append(bytes, std::uint32_t{4});
    for (int face = 0; face < 4; ++face) {
        for (const float component : normals[face]) append(bytes, component);
        for (const int corner : faces[face]) {
            for (const float component : corners[corner]) append(bytes, component);
        }
        append(bytes, std::uint16_t{0});
    }
    return bytes;
}

/// One triangle as GLB, in a node that moves it by (10, 0, 0).
std::string triangle_glb() {
    std::string data;
    for (const float component : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append(data, component);
    for (const std::uint16_t index : {0, 1, 2, 0}) append(data, index);
    std::string json =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
        R"("nodes":[{"mesh":0,"translation":[10,0,0]}],"materials":[{"name":"glass"}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
        R"("buffers":[{"byteLength":44}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},)"
        R"({"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,"componentType":5126,)"
        R"("count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},)"
        R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]})";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string bytes = "glTF";
    append(bytes, std::uint32_t{2});
    append(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + data.size()));
    append(bytes, static_cast<std::uint32_t>(json.size()));
    bytes += "JSON" + json;
    append(bytes, static_cast<std::uint32_t>(data.size()));
    return bytes + std::string("BIN\0", 4) + data;
}

/// The message for a file of this name and content; empty when it loads.
std::string error_of(const std::string& name, const std::string& bytes) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.write(name, bytes);
    try {
        (void)render::load_mesh(file);
    } catch (const std::runtime_error& error) {
        const std::string message = error.what(), place = file.string() + ":";
        EXPECT_EQ(message.substr(0, place.size()), place);
        const std::string found = " error: found ";  // after the line's number, if the error has a line
        std::size_t start = message.find(found);
        EXPECT_EQ(message.substr(0, start).find_first_not_of("0123456789:", place.size()), std::string::npos);
        start += found.size();
        EXPECT_NE(message.find(", expected "), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return message.substr(start);
    }
    return "";
}

TEST(MeshFiles, ObjPartsHaveTheirMaterialsNamesWithoutAMaterialFile) {
    const TemporaryFolder folder;
    const render::Mesh mesh = render::load_mesh(folder.write("t.obj", kTetrahedron));
    ASSERT_EQ(mesh.parts.size(), 2u);
    EXPECT_EQ(mesh.parts[0].material, "slope");
    EXPECT_EQ(mesh.parts[0].indices.size(), 3u);
    EXPECT_EQ(mesh.parts[1].material, "walls");
    EXPECT_EQ(mesh.triangles(), 4u);
    const Eigen::Vector3f slope = mesh.parts[0].normals.front();  // made by the importer: (1, 1, 1) / sqrt 3
    EXPECT_LT((slope - Eigen::Vector3f::Constant(0.57735f)).norm(), 1e-4f);
}

TEST(MeshFiles, BinaryStlAndGlbLoadAndTheNodesTransformIsApplied) {
    const TemporaryFolder folder;
    const std::vector<render::Mesh> meshes = render::load_meshes(
        {folder.write("t.stl", tetrahedron_stl()), folder.write("t.GLB", triangle_glb())});
    EXPECT_EQ(meshes[0].triangles(), 4u);
    EXPECT_EQ(meshes[0].bounds().max(), Eigen::Vector3f::Ones());
    ASSERT_EQ(meshes[1].triangles(), 1u);
    EXPECT_EQ(meshes[1].parts[0].material, "glass");
    EXPECT_EQ(meshes[1].bounds().min(), Eigen::Vector3f(10, 0, 0));
}

/// A cube whose eight corners its faces share, and a ball of 24 x 12 faces, without normals.
std::string cube_obj() {
    std::string text = "usemtl body\n";
    for (int i = 0; i < 8; ++i)
        text += "v " + std::to_string(i % 2) + " " + std::to_string(i / 2 % 2) + " " + std::to_string(i / 4) +
                "\n";
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}
std::string ball_obj() {
    constexpr int kRound = 24, kDown = 12;
    std::string text = "usemtl body\n";
    for (int j = 0; j <= kDown; ++j)
        for (int i = 0; i < kRound; ++i) {
            const double down = M_PI * j / kDown, around = 2 * M_PI * i / kRound;
            text += "v " + std::to_string(std::sin(down) * std::cos(around)) + " " +
                    std::to_string(std::cos(down)) + " " + std::to_string(std::sin(down) * std::sin(around)) +
                    "\n";
        }
    const auto at = [](int j, int i) { return " " + std::to_string(j * kRound + i % kRound + 1); };
    for (int j = 0; j < kDown; ++j)
        for (int i = 0; i < kRound; ++i)
            text += "f" + at(j, i) + at(j, i + 1) + at(j + 1, i + 1) + at(j + 1, i) + "\n";
    return text;
}

TEST(MeshFiles, WithoutNormalsEdgesStaySharpAndRoundSurfacesAreSmooth) {
    const TemporaryFolder folder;
    const render::Mesh cube = render::load_mesh(folder.write("cube.obj", cube_obj()));
    ASSERT_EQ(cube.parts.size(), 1u);
    EXPECT_EQ(cube.parts[0].positions.size(), 24u) << "each corner once a face";
    for (std::size_t i = 0; i < cube.parts[0].indices.size(); i += 3) {
        const auto at = [&](std::size_t k) { return cube.parts[0].positions[cube.parts[0].indices[i + k]]; };
        const Eigen::Vector3f flat = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_LT((cube.parts[0].normals[cube.parts[0].indices[i + k]] - flat).norm(), 1e-5f);
    }
    const render::Mesh ball = render::load_mesh(folder.write("ball.obj", ball_obj()));
    const render::MeshPart& part = ball.parts.at(0);
    // Facets are 15 degrees across: a flat one's normal is 7.5 degrees and more off at its corners; the mean of those around
    // is off by what they are uneven.
    for (std::size_t i = 0; i < part.positions.size(); ++i)
        EXPECT_GT(part.normals[i].dot(part.positions[i].normalized()), std::cos(2 * M_PI / 180)) << i;
}

TEST(MeshFiles, SeveralFilesKeepTheirOrderAndTheFirstBadOneIsNamed) {
    const TemporaryFolder folder;
    std::vector<std::filesystem::path> files;
    for (int i = 1; i <= 6; ++i) {
        files.push_back(folder.write("m" + std::to_string(i) + ".obj",
                                     "v 0 0 0\nv " + std::to_string(i) + " 0 0\nv 0 1 0\nf 1 2 3\n"));
    }
    const std::vector<render::Mesh> meshes = render::load_meshes(files);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(meshes[i].bounds().max().x(), static_cast<float>(i + 1));
    files[4] = folder.path() / "absent.obj";
    try {
        (void)render::load_meshes(files);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), files[4].string() + ": error: found no such file, expected a mesh");
    }
}

TEST(MeshFiles, AFolderAnEmptyFileAnotherFormatAndGarbageAreErrors) {
    const TemporaryFolder folder;
    const std::filesystem::path inner = folder.path() / "folder.obj";
    std::filesystem::create_directory(inner);
    EXPECT_THROW((void)render::load_mesh(inner), std::runtime_error);
    EXPECT_EQ(error_of("a.obj", ""), "an empty file, expected a mesh");
    EXPECT_EQ(error_of("a.ply", "ply\n"), "extension '.ply', expected .obj, .glb, .gltf or .stl");
    EXPECT_NE(error_of("a.obj", std::string(400, '\x7f')), "");
    EXPECT_NE(error_of("a.glb", std::string(400, 'x')), "");
    EXPECT_NE(error_of("a.gltf", "{\"asset\":"), "");
    EXPECT_NE(error_of("a.stl", std::string(400, '\0')), "");
    EXPECT_NE(error_of("a.obj", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"), "");
}

TEST(MeshFiles, TruncatedFilesNotANumberAndIndicesOutOfRangeAreErrors) {
    EXPECT_NE(error_of("a.stl", tetrahedron_stl().substr(0, 150)), "");
    EXPECT_NE(error_of("a.glb", triangle_glb().substr(0, 300)), "");
    EXPECT_NE(error_of("a.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n").find("not finite"),
              std::string::npos);
    EXPECT_NE(error_of("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "");
    EXPECT_NE(error_of("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n"), "");
    EXPECT_NE(error_of("a.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n").find("100000 m"),
              std::string::npos);
    EXPECT_NE(error_of("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n"), "");
}

TEST(MeshFiles, FiveHundredThousandAndOneTrianglesAreTooMany) {
    std::string bytes = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (int i = 0; i < 500001; ++i) bytes += "f 1 2 3\n";
    EXPECT_NE(error_of("a.obj", bytes).find("expected 1 to 500000 triangles"), std::string::npos);
}

TEST(MeshFiles, NinetySixDamagedFilesEndInAnErrorOrAMesh) {
    const std::pair<const char*, std::string> sound[] = {
        {"a.obj", kTetrahedron}, {"a.stl", tetrahedron_stl()}, {"a.glb", triangle_glb()}};
    std::mt19937 random(6);
    int errors = 0;
    for (int round = 0; round < 96; ++round) {
        auto [name, bytes] = sound[round % 3];
        for (unsigned change = 0; change <= random() % 6; ++change)
            bytes[random() % bytes.size()] = static_cast<char>(random());
        if (random() % 6 == 0) bytes.resize(random() % bytes.size());
        errors += error_of(name, bytes) != "";
    }
    EXPECT_GT(errors,
              20);  // most damage to a header or an index is noticed; a changed coordinate is a mesh still
}

}  // namespace
