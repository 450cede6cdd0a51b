#include "mesh_stream.h"

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace render {
namespace {

constexpr std::string_view kMeshMagic = "MWMESH1\n", kFailMagic = "MWFAIL1\n", kEnd = "END\n";
constexpr std::size_t kMaxParts = 4096, kMaxNameLength = 1024, kMaxReasonLength = 240;

void append_u32(std::string& out, std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    out.append(reinterpret_cast<const char*>(&word), sizeof word);
}

template <typename Element>
void append_array(std::string& out, const std::vector<Element>& elements) {
    out.append(reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(Element));
}

/// Takes fields from the front of the stream; throws where it ends too early.
class StreamReader {
public:
    explicit StreamReader(std::string_view bytes) : rest_(bytes) {}

    std::string_view take(std::size_t length) {
        if (length > rest_.size())
            throw std::runtime_error("found an incomplete import, expected a whole mesh");
        const std::string_view taken = rest_.substr(0, length);
        rest_.remove_prefix(length);
        return taken;
    }

    std::size_t take_count(std::size_t limit, const char* what) {
        std::uint32_t word = 0;
        std::memcpy(&word, take(sizeof word).data(), sizeof word);
        if (word > limit) {
            throw std::runtime_error("found " + std::to_string(word) + " " + what + ", expected at most " +
                                     std::to_string(limit));
        }
        return word;
    }

    template <typename Element>
    void take_array(std::vector<Element>& elements, std::size_t count) {
        const std::string_view bytes = take(count * sizeof(Element));
        elements.resize(count);
        if (count > 0) std::memcpy(static_cast<void*>(elements.data()), bytes.data(), bytes.size());
    }

private:
    std::string_view rest_;
};

void check_vectors(const MeshPart& part) {
    for (const Eigen::Vector3f& position : part.positions) {
        if (!position.allFinite())
            throw std::runtime_error("found a coordinate that is not finite, expected numbers");
        if (position.cwiseAbs().maxCoeff() > kMaxCoordinate) {
            throw std::runtime_error("found a coordinate beyond 100000 m, expected a mesh in metres");
        }
    }
    for (const Eigen::Vector3f& normal : part.normals) {
        if (!(std::abs(normal.norm() - 1) < 1e-3f)) {
            throw std::runtime_error("found a normal that has not unit length, expected unit normals");
        }
    }
}

void check_indices(const MeshPart& part) {
    if (part.indices.size() % 3 != 0)
        throw std::runtime_error("found a broken triangle, expected three indices each");
    for (const std::uint32_t index : part.indices) {
        if (index >= part.positions.size()) {
            throw std::runtime_error("found vertex index " + std::to_string(index) + ", expected less than " +
                                     std::to_string(part.positions.size()));
        }
    }
}

MeshPart read_part(StreamReader& reader) {
    MeshPart part;
    part.material = reader.take(reader.take_count(kMaxNameLength, "bytes in a material's name"));
    const std::size_t vertices = reader.take_count(3 * kMaxTriangles, "vertices");
    const std::size_t indices = reader.take_count(3 * kMaxTriangles, "indices");
    reader.take_array(part.positions, vertices);
    reader.take_array(part.normals, vertices);
    reader.take_array(part.indices, indices);
    check_vectors(part);
    check_indices(part);
    return part;
}

/// The importer's own words may hold line breaks and bytes of the file.
std::string one_printable_line(std::string_view text) {
    std::string line;
    for (const char c : text.substr(0, kMaxReasonLength)) line += c >= ' ' && c <= '~' ? c : ' ';
    while (!line.empty() && line.back() == ' ') line.pop_back();
    return line;
}

}  // namespace

std::string encode_mesh_stream(const Mesh& mesh) {
    std::string out(kMeshMagic);
    append_u32(out, mesh.parts.size());
    for (const MeshPart& part : mesh.parts) {
        append_u32(out, part.material.size());
        out += part.material;
        append_u32(out, part.positions.size());
        append_u32(out, part.indices.size());
        append_array(out, part.positions);
        append_array(out, part.normals);
        append_array(out, part.indices);
    }
    return out.append(kEnd);
}

std::string encode_mesh_failure(const std::string& reason) {
    return std::string(kFailMagic) + reason;
}

Mesh decode_mesh_stream(const std::string& bytes) {
    StreamReader reader(bytes);
    const std::string_view magic = reader.take(kMeshMagic.size());
    if (magic == kFailMagic) {
        throw std::runtime_error(one_printable_line(std::string_view(bytes).substr(kFailMagic.size())));
    }
    if (magic != kMeshMagic) throw std::runtime_error("found an unknown import stream, expected a mesh");
    Mesh mesh;
    mesh.parts.resize(reader.take_count(kMaxParts, "materials"));
    for (MeshPart& part : mesh.parts) part = read_part(reader);
    if (reader.take(kEnd.size()) != kEnd)
        throw std::runtime_error("found a broken import stream, expected its end");
    if (mesh.triangles() == 0) throw std::runtime_error("found no triangles, expected 1 to 500000");
    if (mesh.triangles() > kMaxTriangles) {
        throw std::runtime_error("found " + std::to_string(mesh.triangles()) +
                                 " triangles, expected 1 to 500000");
    }
    return mesh;
}

}  // namespace render
