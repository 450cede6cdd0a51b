#include "assimp_mesh.h"

#include <assimp/BaseImporter.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "crease_normals.h"
#include "mesh_stream.h"

namespace render {
namespace {

/// Assimp picks a reader by the content when the extension's own reader declines; leave it no others to pick.
void keep_allowed_readers(Assimp::Importer& importer) {
    for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
        Assimp::BaseImporter* reader = importer.GetImporter(i);
        std::set<std::string> extensions;
        reader->GetExtensionList(extensions);
        if (!extensions.contains("obj") && !extensions.contains("glb") && !extensions.contains("stl")) {
            importer.UnregisterLoader(reader);
            delete reader;  // unregistering hands it to the caller
        }
    }
}

bool is_finite(const aiVector3D& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Before any post-processing: that trusts what the file said.
void check_raw(const aiMesh& mesh, std::size_t& faces) {
    faces += mesh.mNumFaces;
    if (faces > kMaxTriangles) {
        throw std::runtime_error("found over 500000 faces, expected 1 to 500000 triangles");
    }
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        if (!is_finite(mesh.mVertices[i]) || (mesh.HasNormals() && !is_finite(mesh.mNormals[i]))) {
            throw std::runtime_error("found a coordinate that is not finite, expected numbers");
        }
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        for (unsigned k = 0; k < mesh.mFaces[f].mNumIndices; ++k) {
            if (mesh.mFaces[f].mIndices[k] >= mesh.mNumVertices) {
                throw std::runtime_error("found vertex index " + std::to_string(mesh.mFaces[f].mIndices[k]) +
                                         ", expected less than " + std::to_string(mesh.mNumVertices));
            }
        }
    }
}

Eigen::Vector3f unit_or_up(const aiVector3D& v) {
    const Eigen::Vector3f normal(v.x, v.y, v.z);
    const float length = normal.norm();
    return std::isfinite(length) && length > 1e-12f ? Eigen::Vector3f(normal / length)
                                                    : Eigen::Vector3f::UnitY();
}

MeshPart part_of(const aiMesh& mesh) {
    MeshPart part;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        part.positions.emplace_back(mesh.mVertices[i].x, mesh.mVertices[i].y, mesh.mVertices[i].z);
        if (mesh.HasNormals()) part.normals.push_back(unit_or_up(mesh.mNormals[i]));
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices != 3) continue;
        for (unsigned k = 0; k < 3; ++k) part.indices.push_back(face.mIndices[k]);
    }
    if (!mesh.HasNormals()) make_normals(part);
    return part;
}

void append(const MeshPart& more, MeshPart& part) {
    const auto base = static_cast<std::uint32_t>(part.positions.size());
    part.positions.insert(part.positions.end(), more.positions.begin(), more.positions.end());
    part.normals.insert(part.normals.end(), more.normals.begin(), more.normals.end());
    for (const std::uint32_t index : more.indices) part.indices.push_back(base + index);
}

std::string material_name(const aiScene& scene, const aiMesh& mesh) {
    if (mesh.mMaterialIndex >= scene.mNumMaterials) return {};
    return scene.mMaterials[mesh.mMaterialIndex]->GetName().C_Str();
}

}  // namespace

Mesh import_with_assimp(const std::filesystem::path& file) {
    Assimp::Importer importer;
    keep_allowed_readers(importer);
    const auto require = [&](const aiScene* scene) {
        if (scene == nullptr || scene->mNumMeshes == 0) {
            throw std::runtime_error("found what cannot be read (" + std::string(importer.GetErrorString()) +
                                     "), expected a mesh in the format of its extension");
        }
        return scene;
    };
    const aiScene* raw = require(importer.ReadFile(file.string(), aiProcess_ValidateDataStructure));
    std::size_t faces = 0;
    for (unsigned m = 0; m < raw->mNumMeshes; ++m) check_raw(*raw->mMeshes[m], faces);

    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = require(
        importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType |
                                     aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices));
    std::map<std::string, MeshPart> parts;  // one a name, in the names' order
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        append(part_of(*scene->mMeshes[m]), parts[material_name(*scene, *scene->mMeshes[m])]);
    }
    Mesh mesh;
    for (auto& [name, part] : parts) {
        part.material = name;
        mesh.parts.push_back(std::move(part));
    }
    return mesh;
}

}  // namespace render
