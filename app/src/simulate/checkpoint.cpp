#include "simulate/checkpoint.h"

#include <fmt/format.h>
#include <tracking/input.h>

#include <array>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "files/bad_input.h"
#include "files/checksum.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

//   offset  bytes  little-endian
//   0       8      "MWCHECK\n"
//   8       4      version, 2
//   12      4      length of what comes next
//   16      8      length of what comes then
//   24      ...    JSON: all but the state; words and names of files as lists of bytes, doubles as their 64 bits
//   ...     ...    the state of the world (sim/src/run/run_state.cpp)
//   end-8   8      FNV-1a 64 of everything before

constexpr std::string_view kMagic = "MWCHECK\n";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kVersionAt = 8, kHeaderBytes = 24, kChecksumBytes = 8;

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

template <typename Number>
void append(std::vector<std::uint8_t>& bytes, Number number) {
    const auto at = bytes.size();
    bytes.resize(at + sizeof number);
    std::memcpy(bytes.data() + at, &number, sizeof number);
}

template <typename Number>
Number number_at(std::string_view bytes, std::size_t at) {
    Number number;
    std::memcpy(&number, bytes.data() + at, sizeof number);
    return number;
}

std::uint64_t checksum_of(std::string_view bytes) {
    return fnv1a_64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

json bits_of(double number) {
    return std::bit_cast<std::uint64_t>(number);
}

double double_of(const json& bits) {
    return std::bit_cast<double>(bits.get<std::uint64_t>());
}

json bytes_of(const std::string& text) {
    return std::vector<std::uint8_t>(text.begin(), text.end());
}

std::string text_of(const json& bytes) {
    const auto all = bytes.get<std::vector<std::uint8_t>>();
    return {all.begin(), all.end()};
}

json list_of(const std::vector<std::string>& texts) {
    json list = json::array();
    for (const std::string& text : texts) list.push_back(bytes_of(text));
    return list;
}

std::vector<std::string> texts_of(const json& list) {
    std::vector<std::string> texts;
    for (const json& text : list) texts.push_back(text_of(text));
    return texts;
}

json json_of(const Checkpoint& c) {
    const RecordState& r = c.record;
    const MomentumWatch::Largest& m = r.momentum;
    return {{"words", list_of(c.words)},
            {"directory", bytes_of(c.directory.string())},
            {"version", c.version},
            {"build", c.build},
            {"scene_sha256", c.scene_sha256},
            {"table_bytes", r.table_bytes},
            {"next_frame", r.next_frame},
            {"body_steps", r.body_steps},
            {"momentum", {bits_of(m.linear), bits_of(m.angular), bits_of(m.scale)}},
            {"spun", r.spun},
            {"wall_s", bits_of(r.wall_s)}};
}

void read(const json& saved, Checkpoint& c) {
    c.words = texts_of(saved.at("words"));
    c.directory = text_of(saved.at("directory"));
    saved.at("version").get_to(c.version);
    saved.at("build").get_to(c.build);
    saved.at("scene_sha256").get_to(c.scene_sha256);
    RecordState& r = c.record;
    saved.at("table_bytes").get_to(r.table_bytes);
    saved.at("next_frame").get_to(r.next_frame);
    saved.at("body_steps").get_to(r.body_steps);
    const json& momentum = saved.at("momentum");
    r.momentum = {double_of(momentum.at(0)), double_of(momentum.at(1)), double_of(momentum.at(2))};
    saved.at("spun").get_to(r.spun);
    r.wall_s = double_of(saved.at("wall_s"));
}

[[noreturn]] void refuse(const fs::path& file, std::size_t at, const std::string& found,
                         const std::string& expected) {
    throw BadInput(fmt::format("{}:byte {}: error: found {}, expected {}; begin the run anew", file.string(),
                               at, found, expected));
}

}  // namespace

std::string program_build() {
    sim::WorldDefinition definition;
    definition.planes.push_back({});
    for (int i = 0; i < 2; ++i) {  // soft bodies that fall onto the floor and each other
        sim::WorldBody& body = definition.bodies.emplace_back();
        body.shape.base = {{0.5, 0.4 + 0.1 * i, 0.6}, 0.8, 1.2};
        body.material = {1e5, 0.3, 100};
        body.fidelity.fidelity = sim::Fidelity::modal;
        body.world_from_body.translation() = Eigen::Vector3d(0.1 * i, 0.5 + i, 0);
        body.angular_velocity = {1, 2, 3};
    }
    sim::World world(definition);
    for (int i = 0; i < 30; ++i) world.step();
    return fingerprint(std::bit_cast<std::array<std::uint8_t, 8>>(world.state_hash()));
}

fs::path checkpoint_file(const fs::path& out) {
    return out / ".unfinished" / "scratch" / "checkpoint";
}

std::vector<std::uint8_t> format_checkpoint(const Checkpoint& checkpoint) {
    const std::string text = json_of(checkpoint).dump();
    std::vector<std::uint8_t> bytes(kMagic.begin(), kMagic.end());
    append(bytes, kVersion);
    append(bytes, static_cast<std::uint32_t>(text.size()));
    append(bytes, std::uint64_t{checkpoint.state.size()});
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.insert(bytes.end(), checkpoint.state.begin(), checkpoint.state.end());
    append(bytes, fnv1a_64(bytes));
    return bytes;
}

Checkpoint read_checkpoint(const fs::path& file) {
    std::error_code none;
    if (!fs::exists(file, none))
        throw BadInput(fmt::format(
            "{}: error: found no such file, expected the checkpoint of an unfinished run; name the folder of "
            "a run with --checkpoint that was interrupted",
            file.string()));
    const std::string bytes = tracking::read_bytes(file.string());
    const std::string_view all = bytes;
    if (!all.starts_with(kMagic) || all.size() < kHeaderBytes + kChecksumBytes)
        refuse(file, 0, "no checkpoint", "one that simulate --checkpoint saved");
    if (const auto version = number_at<std::uint32_t>(all, kVersionAt); version != kVersion)
        refuse(file, kVersionAt, fmt::format("version {}", version), fmt::format("{}", kVersion));
    const std::uint64_t body = all.size() - kHeaderBytes - kChecksumBytes;
    const std::uint64_t text = number_at<std::uint32_t>(all, 12), state = number_at<std::uint64_t>(all, 16);
    if (text > body || state != body - text)
        refuse(file, 12, fmt::format("lengths of {} and {}", text, state), fmt::format("{} in all", body));
    const std::string_view saved = all.substr(0, all.size() - kChecksumBytes);
    const auto sum = number_at<std::uint64_t>(all, saved.size());
    if (const std::uint64_t expected = checksum_of(saved); sum != expected)
        refuse(file, saved.size(), fmt::format("checksum {:016x}", sum), fmt::format("{:016x}", expected));
    Checkpoint checkpoint;
    try {
        read(json::parse(saved.substr(kHeaderBytes, text)), checkpoint);
    } catch (const json::exception& wrong) {
        refuse(file, kHeaderBytes, one_line(wrong.what()), "what simulate --checkpoint saves");
    }
    const std::string_view rest = saved.substr(kHeaderBytes + text);
    checkpoint.state.assign(rest.begin(), rest.end());
    return checkpoint;
}

}  // namespace app
