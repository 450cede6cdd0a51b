#include "obj_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "mesh_stream.h"

namespace render {
namespace {

/// The file has what this reader leaves to the importer.
struct NotPlain {};

/// Takes the next word from the front of a line; empty at its end.
std::string_view next_word(std::string_view& line) {
    constexpr std::string_view kBlank = " \t\r";
    line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(kBlank));
    line.remove_prefix(word.size());
    return word;
}

std::string quoted(std::string_view word) {
    std::string text = "'";
    for (const char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + "'";
}

class PlainObj {
public:
    explicit PlainObj(const std::filesystem::path& file) : file_(file.string()) {}

    void read(std::string_view text) {
        while (!text.empty()) {
            ++line_number_;
            const std::string_view line = text.substr(0, text.find('\n'));
            text.remove_prefix(std::min(line.size() + 1, text.size()));
            read_line(line);
        }
    }
    [[nodiscard]] Mesh mesh() {
        if (triangles_ == 0) throw NotPlain{};
        Mesh mesh;
        for (auto& [name, part] : parts_)
            if (!part.made.indices.empty()) mesh.parts.push_back(std::move(part.made));
        return mesh;
    }

private:
    using Corner = std::pair<std::uint32_t, std::uint32_t>;  ///< position, normal
    struct Part {
        MeshPart made;
        std::map<Corner, std::uint32_t> vertices;
    };

    [[noreturn]] void refuse(const std::string& found, const std::string& expected) const {
        throw MeshError(file_ + ":" + std::to_string(line_number_) + ": error: found " + found +
                        ", expected " + expected);
    }
    void read_line(std::string_view line);
    void read_triangle(std::string_view line);
    [[nodiscard]] Eigen::Vector3f read_vector(std::string_view line) const;
    [[nodiscard]] Corner read_corner(std::string_view word) const;
    [[nodiscard]] std::uint32_t read_index(std::string_view digits, std::size_t count,
                                           const char* what) const;
    [[nodiscard]] std::uint32_t vertex_of(const Corner& corner);
    void add_position(const Eigen::Vector3f& position);
    void add_normal(const Eigen::Vector3f& normal);

    std::string file_;
    std::size_t line_number_ = 0, triangles_ = 0;
    std::vector<Eigen::Vector3f> positions_, normals_;
    std::map<std::string, Part> parts_;
    Part* part_ = nullptr;
};

void PlainObj::read_line(std::string_view line) {
    const std::string_view keyword = next_word(line);
    if (keyword == "v")
        add_position(read_vector(line));
    else if (keyword == "vn")
        add_normal(read_vector(line));
    else if (keyword == "f")
        read_triangle(line);
    else if (keyword == "usemtl") {
        const std::string name(next_word(line));
        if (name.empty() || !next_word(line).empty()) throw NotPlain{};
        part_ = &parts_[name];
        part_->made.material = name;
    } else if (!keyword.empty() && !keyword.starts_with('#') && keyword != "o" && keyword != "g" &&
               keyword != "s") {
        throw NotPlain{};
    }
}

Eigen::Vector3f PlainObj::read_vector(std::string_view line) const {
    Eigen::Vector3f vector;
    for (float& component : vector) {
        const std::string_view word = next_word(line);
        const auto [end, wrong] = std::from_chars(word.data(), word.data() + word.size(), component);
        if (wrong != std::errc() || end != word.data() + word.size())
            refuse(word.empty() ? "fewer than three numbers" : quoted(word), "three numbers");
        if (!std::isfinite(component)) refuse("a number that is not finite", "finite numbers");
    }
    if (!next_word(line).empty()) throw NotPlain{};  // weights, colours
    return vector;
}

void PlainObj::add_position(const Eigen::Vector3f& position) {
    if (position.cwiseAbs().maxCoeff() > kMaxCoordinate)
        refuse("a coordinate beyond 100000 m", "a mesh in metres");
    positions_.push_back(position);
}

void PlainObj::add_normal(const Eigen::Vector3f& normal) {
    const float length = normal.norm();
    if (!std::isfinite(length) || length < 1e-12f) refuse("a normal without length", "a direction");
    normals_.push_back(normal / length);
}

std::uint32_t PlainObj::read_index(std::string_view digits, std::size_t count, const char* what) const {
    std::uint32_t index = 0;
    const auto [end, wrong] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    if (wrong == std::errc::invalid_argument || end != digits.data() + digits.size()) throw NotPlain{};
    if (wrong != std::errc() || index == 0 || index > count)
        refuse(std::string(what) + " " + quoted(digits),
               "1 to " + std::to_string(count) + " as given before");
    return index - 1;
}

PlainObj::Corner PlainObj::read_corner(std::string_view word) const {
    const std::size_t slashes = word.find("//");
    if (slashes == std::string_view::npos) throw NotPlain{};
    return {read_index(word.substr(0, slashes), positions_.size(), "vertex"),
            read_index(word.substr(slashes + 2), normals_.size(), "normal")};
}

void PlainObj::read_triangle(std::string_view line) {
    if (part_ == nullptr) throw NotPlain{};  // no material: the importer has a name for it
    std::uint32_t vertices[3];
    for (std::uint32_t& vertex : vertices) {
        const std::string_view word = next_word(line);
        if (word.empty()) throw NotPlain{};  // a line or a point
        vertex = vertex_of(read_corner(word));
    }
    if (!next_word(line).empty()) throw NotPlain{};
    if (++triangles_ > kMaxTriangles) refuse("over 500000 triangles", "1 to 500000 triangles");
    part_->made.indices.insert(part_->made.indices.end(), std::begin(vertices), std::end(vertices));
}

std::uint32_t PlainObj::vertex_of(const Corner& corner) {
    MeshPart& part = part_->made;
    const auto next = static_cast<std::uint32_t>(part.positions.size());
    const auto [found, added] = part_->vertices.try_emplace(corner, next);
    if (added) {
        part.positions.push_back(positions_[corner.first]);
        part.normals.push_back(normals_[corner.second]);
    }
    return found->second;
}

}  // namespace

std::optional<Mesh> read_plain_obj(const std::filesystem::path& file, std::string_view text) {
    try {
        PlainObj obj(file);
        obj.read(text);
        return obj.mesh();
    } catch (const NotPlain&) {
        return {};
    }
}

}  // namespace render
