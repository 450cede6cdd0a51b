#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "import_process.h"
#include "mesh_stream.h"
#include "obj_reader.h"
#include "render/mesh.h"

namespace render {
namespace {

constexpr std::size_t kChildrenAtOnce = 4;
constexpr std::uintmax_t kMostPlainBytes = 64u << 20;  // what is larger is for the importer

/// The extension in lower case. Throws for what cannot be a mesh.
std::string checked_extension(const std::filesystem::path& file) {
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
    return extension;
}

/// A mesh that is read here, or nothing: it is for the importer.
std::optional<Mesh> read_here(const std::filesystem::path& file, const std::string& extension) {
    if (extension != ".obj" || std::filesystem::file_size(file) > kMostPlainBytes) return {};
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (!in.is_open() || in.bad()) return {};
    return read_plain_obj(file, text);
}

std::string without_controls(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return text;
}

/// Runs one stage of one file's import and puts the file's name before what went wrong.
template <typename Stage>
auto naming_file(const std::filesystem::path& file, Stage stage) {
    try {
        return stage();
    } catch (const std::system_error&) {  // of the machine, not of the file
        throw;
    } catch (const std::runtime_error& error) {
        throw MeshError(file.string() + ": error: " + error.what());
    }
}

}  // namespace

MeshError::MeshError(std::string text) : std::runtime_error(without_controls(std::move(text))) {}

std::vector<Mesh> load_meshes(const std::vector<std::filesystem::path>& files) {
    std::vector<Mesh> meshes(files.size());
    for (std::size_t first = 0; first < files.size(); first += kChildrenAtOnce) {
        const std::size_t last = std::min(first + kChildrenAtOnce, files.size());
        std::vector<std::unique_ptr<ImportProcess>> children(last - first);
        for (std::size_t i = first; i < last; ++i) {
            const std::string extension = naming_file(files[i], [&] { return checked_extension(files[i]); });
            if (std::optional<Mesh> mesh = read_here(files[i], extension))
                meshes[i] = std::move(*mesh);
            else
                children[i - first] =
                    naming_file(files[i], [&] { return std::make_unique<ImportProcess>(files[i]); });
        }
        for (std::size_t i = first; i < last; ++i)
            if (ImportProcess* child = children[i - first].get())
                meshes[i] = naming_file(files[i], [&] { return decode_mesh_stream(child->output()); });
    }
    return meshes;
}

Mesh load_mesh(const std::filesystem::path& file) {
    return std::move(load_meshes({file}).front());
}

}  // namespace render
