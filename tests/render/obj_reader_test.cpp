#include "obj_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>

#include "import_process.h"
#include "mesh_stream.h"

namespace {

namespace fs = std::filesystem;

const std::string kTwoTriangles =
    "# A square of two materials\no square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nvn 0 1 0\n"
    "usemtl wood\nf 1//1 2//1 3//1\nusemtl metal\nf 1//1 3//1 4//2\n";

std::optional<render::Mesh> read(const std::string& text) {
    return render::read_plain_obj("fuzz.obj", text);
}

std::string error_of(const std::string& text) {
    try {
        return read(text) ? "a mesh" : "for the importer";
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

/// The corner's position and normal.
Eigen::Matrix<float, 6, 1> corner(const render::MeshPart& part, std::size_t k) {
    Eigen::Matrix<float, 6, 1> both;
    both << part.positions[part.indices[k]], part.normals[part.indices[k]];
    return both;
}

TEST(ObjReader, PartsAreInTheOrderOfTheirNamesAndCornersThatAgreeShareAVertex) {
    const render::Mesh mesh = read(kTwoTriangles).value();
    ASSERT_EQ(mesh.parts.size(), 2u);
    EXPECT_EQ(mesh.parts[0].material, "metal");
    EXPECT_EQ(mesh.parts[1].material, "wood");
    EXPECT_EQ(mesh.parts[1].positions[2], Eigen::Vector3f(1, 1, 0));
    EXPECT_EQ(mesh.parts[1].normals[2], Eigen::Vector3f::UnitZ());  // made a unit vector
    EXPECT_EQ(mesh.parts[0].normals[2], Eigen::Vector3f::UnitY());
    const render::Mesh twice = read(kTwoTriangles + "f 1//1 3//1 4//2\nf 1//2 3//1 4//2\n").value();
    EXPECT_EQ(twice.parts[0].positions.size(), 4u);
    EXPECT_EQ(twice.parts[0].indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2, 3, 1, 2}));
}

TEST(ObjReader, TheBundledMeshesHaveTheImportersTrianglesToTheBit) {
    int files = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(MUSICWORLD_SOURCE_DIR "/assets/meshes")) {
        if (entry.path().extension() != ".obj") continue;
        ++files;
        std::ifstream in(entry.path(), std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
        const std::optional<render::Mesh> ours = render::read_plain_obj(entry.path(), text);
        ASSERT_TRUE(ours) << entry.path();
        const render::Mesh theirs = render::decode_mesh_stream(render::ImportProcess(entry.path()).output());
        ASSERT_EQ(ours->parts.size(), theirs.parts.size()) << entry.path();
        for (std::size_t p = 0; p < ours->parts.size(); ++p) {
            const render::MeshPart &a = ours->parts[p], &b = theirs.parts[p];
            EXPECT_EQ(a.material, b.material);
            ASSERT_EQ(a.indices.size(), b.indices.size());
            for (std::size_t k = 0; k < a.indices.size(); ++k)
                ASSERT_EQ(corner(a, k), corner(b, k)) << entry.path() << " corner " << k;
        }
    }
    EXPECT_EQ(files, 9);
}

TEST(ObjReader, ErrorsNameTheLineWhatWasFoundAndWhatWasExpected) {
    const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nusemtl a\n";
    EXPECT_EQ(error_of("v 0 0 0\nv 1 zero 0\n"), "fuzz.obj:2: error: found 'zero', expected three numbers");
    EXPECT_EQ(error_of("v 0 0\n"),
              "fuzz.obj:1: error: found fewer than three numbers, expected three numbers");
    EXPECT_EQ(error_of("v 0 nan 0\n"),
              "fuzz.obj:1: error: found a number that is not finite, expected finite numbers");
    EXPECT_EQ(error_of("v 0 2e5 0\n"),
              "fuzz.obj:1: error: found a coordinate beyond 100000 m, expected a mesh in metres");
    EXPECT_EQ(error_of("vn 0 0 0\n"),
              "fuzz.obj:1: error: found a normal without length, expected a direction");
    EXPECT_EQ(error_of(start + "f 1//1 2//1 4//1\n"),
              "fuzz.obj:6: error: found vertex '4', expected 1 to 3 as given before");
    EXPECT_EQ(error_of(start + "f 1//1 2//1 3//0\n"),
              "fuzz.obj:6: error: found normal '0', expected 1 to 1 as given before");
    std::string many = start;
    for (int i = 0; i < 500001; ++i) many += "f 1//1 2//1 3//1\n";
    EXPECT_EQ(error_of(many),
              "fuzz.obj:500006: error: found over 500000 triangles, expected 1 to 500000 triangles");
}

TEST(ObjReader, WhatOtherProgramsWriteIsForTheImporter) {
    const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nusemtl a\n";
    for (const char* line :
         {"f 1 2 3", "f 1/1/1 2/1/1 3/1/1", "f 1//1 2//1 3//1 4//1", "f -1//-1 -2//-1 -3//-1", "vt 0 0",
          "mtllib a.mtl", "v 0 0 0 1", "l 1 2", "usemtl two words", "f 1//1 2//1"})
        EXPECT_EQ(error_of(start + line + "\nf 1//1 2//1 3//1\n"), "for the importer") << line;
    EXPECT_EQ(error_of("v 0 0 0\nvn 0 0 1\nf 1//1 1//1 1//1\n"), "for the importer");  // no material
    EXPECT_EQ(error_of(start), "for the importer");                                    // no triangle
    EXPECT_EQ(error_of(""), "for the importer");
}

TEST(ObjReader, TwentyThousandDamagedFilesEndInALocatedErrorASoundMeshOrAreLeft) {
    std::mt19937 random(7);
    const std::string tokens[] = {"nan",      "\n", "1e99",  "-", "//", std::string(1, '\0'),
                                  "\xFF\xFF", " ",  "f 1//1"};
    int meshes = 0, errors = 0, left = 0;
    for (int round = 0; round < 20000; ++round) {
        std::string text = kTwoTriangles;
        for (unsigned change = 0; change <= random() % 3; ++change) {
            const std::size_t at = random() % text.size();
            const unsigned kind = random() % 4;
            if (kind == 0) text[at] = static_cast<char>(random());
            if (kind == 1) text.insert(at, tokens[random() % std::size(tokens)]);
            if (kind == 2) text[at] = static_cast<char>('0' + random() % 10);
            if (kind == 3 && random() % 4 == 0) text.resize(at + 1);
        }
        try {
            const std::optional<render::Mesh> mesh = read(text);
            ++(mesh ? meshes : left);
            if (!mesh) continue;
            for (const render::MeshPart& part : mesh->parts) {
                ASSERT_EQ(part.positions.size(), part.normals.size());
                for (const Eigen::Vector3f& position : part.positions)
                    ASSERT_LE(position.cwiseAbs().maxCoeff(), render::kMaxCoordinate);
                for (const Eigen::Vector3f& normal : part.normals) ASSERT_NEAR(normal.norm(), 1, 1e-3);
                ASSERT_EQ(part.indices.size() % 3, 0u);
                for (const std::uint32_t index : part.indices) ASSERT_LT(index, part.positions.size());
            }
        } catch (const std::runtime_error& error) {
            ++errors;
            const std::string message = error.what();
            ASSERT_TRUE(message.starts_with("fuzz.obj:")) << message;
            ASSERT_NE(message.find(": error: found "), std::string::npos) << message;
            ASSERT_EQ(message.find_first_of(std::string("\n\0", 2)), std::string::npos) << message;
        }
    }
    EXPECT_GT(meshes, 1000);
    EXPECT_GT(errors, 1000);
    EXPECT_GT(left, 1000);
}

}  // namespace
