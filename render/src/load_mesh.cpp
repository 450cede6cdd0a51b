#include <algorithm>
#include <cctype>
#include <memory>
#include <stdexcept>

#include "import_process.h"
#include "mesh_stream.h"
#include "render/mesh.h"

namespace render {
namespace {

constexpr std::size_t kChildrenAtOnce = 4;

void check_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) throw std::runtime_error("found no such file, expected a mesh");
    if (!std::filesystem::is_regular_file(status)) {
        throw std::runtime_error("found what is not a regular file, expected a mesh");
    }
    if (std::filesystem::file_size(file, error) == 0)
        throw std::runtime_error("found an empty file, expected a mesh");
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".obj" && extension != ".glb" && extension != ".gltf" && extension != ".stl") {
        throw std::runtime_error("found extension '" + extension + "', expected .obj, .glb, .gltf or .stl");
    }
}

/// Runs one stage of one file's import and puts the file's name before what went wrong.
template <typename Stage>
auto naming_file(const std::filesystem::path& file, Stage stage) {
    try {
        return stage();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(file.string() + ": error: " + error.what());
    }
}

}  // namespace

std::vector<Mesh> load_meshes(const std::vector<std::filesystem::path>& files) {
    std::vector<Mesh> meshes;
    for (std::size_t first = 0; first < files.size(); first += kChildrenAtOnce) {
        const std::size_t last = std::min(first + kChildrenAtOnce, files.size());
        std::vector<std::unique_ptr<ImportProcess>> children;
        for (std::size_t i = first; i < last; ++i) {
            children.push_back(naming_file(files[i], [&] {
                check_file(files[i]);
                return std::make_unique<ImportProcess>(files[i]);
            }));
        }
        for (std::size_t i = first; i < last; ++i) {
            meshes.push_back(
                naming_file(files[i], [&] { return decode_mesh_stream(children[i - first]->output()); }));
        }
    }
    return meshes;
}

Mesh load_mesh(const std::filesystem::path& file) {
    return std::move(load_meshes({file}).front());
}

}  // namespace render
