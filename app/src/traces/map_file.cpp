#include "traces/map_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <sstream>

#include "files/bad_input.h"
#include "files/toml_reader.h"

namespace fs = std::filesystem;

namespace app {
namespace {

template <class Value>
using Words = std::vector<Word<Value>>;

const Words<std::optional<double>> kMetres = {{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}};
const Words<double> kSeconds = {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
const Words<char> kSeparators = {{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"space", ' '}};
const Words<std::optional<Eigen::Vector3d>> kAxes = {
    {"+x", Eigen::Vector3d(1, 0, 0)},  {"-x", Eigen::Vector3d(-1, 0, 0)}, {"+y", Eigen::Vector3d(0, 1, 0)},
    {"-y", Eigen::Vector3d(0, -1, 0)}, {"+z", Eigen::Vector3d(0, 0, 1)},  {"-z", Eigen::Vector3d(0, 0, -1)}};

template <class Value>
std::string word_for(const Words<Value>& words, Value value) {
    for (const auto& [name, meant] : words)
        if (meant == value) return name;
    return words.front().name;
}

void unit_keys(Fields& keys, tracking::ColumnMap& map) {
    keys.choice("units", map.metres_per_unit, kMetres,
                "Unit of positions; m unless said, cm in the frame unreal.", {.example = "\"mm\""});
    keys.text("units_from", map.units_from,
              "Above the header, a cell of this text stands before the unit's name; it goes before `units`.");
    keys.choice("up", map.z_up, {{"y", false}, {"z", true}}, "The axis that points up.");
    keys.text("frame", map.frame,
              "Where the axes x, y and z of the world and of the tracked bodies point, in place of `up`: "
              "three letters, R or L for right or left, U or D for up or down, F or B for forward or back; "
              "`unity` is RUF, `unreal` FRU, ours RUB. Left-handed data become right-handed; tip_m and "
              "shaft are meant in our axes, in which forward is -z.");
    keys.choice("euler", map.euler,
                {{"", ""},
                 {"XYZ", "XYZ"},
                 {"XZY", "XZY"},
                 {"YXZ", "YXZ"},
                 {"YZX", "YZX"},
                 {"ZXY", "ZXY"},
                 {"ZYX", "ZYX"}},
                "Order of the intrinsic turns, where columns ex, ey, ez hold Euler angles (extrinsic ones: "
                "write the order backwards).");
    keys.choice("angles", map.radians, {{"degrees", false}, {"radians", true}}, "Unit of Euler angles.");
    keys.choice("time_unit", map.seconds_per_unit, kSeconds,
                "Unit of times that are numbers. Times by ISO 8601, such as 2026-05-01T12:00:00.25+02:00 or "
                "12:00:00.25, are recognised and count from the first row's.");
    keys.flag("from_zero", map.from_zero, "Times count from the first row's.");
    keys.number("rate_hz", map.rate_hz, {0, 1e5, "Hz"},
                "Rate of frames, where there are no times; 0: not known.");
    keys.text("rate_from", map.rate_from,
              "Above the header, a cell of this text stands before the rate, unless the rate is given.");
    keys.choice(
        "lost", map.zero_is_lost, {{"empty", false}, {"zeros", true}},
        "What stands for a stick that is not seen: empty cells and NaN, or also a position of three zeros.");
    keys.vector("tip_m", map.tip, {-3, 3, "m"}, "Centre of the tip in the tracked body's frame.",
                {.example = "[0, 0, -0.4]"});
    keys.choice("shaft", map.shaft, kAxes, "Axis of the tracked body from hand to tip.",
                {.example = "\"-z\""});
}

void map_keys(Fields& keys, tracking::ColumnMap& map) {
    std::string description;
    keys.text("description", description, "One line about it.");
    keys.text("signature", map.signature,
              "Text within a file's first 2000 bytes that tells this kind of file: then the map is found "
              "without naming it.");
    keys.choice("separator", map.separator, kSeparators,
                "Between columns; space: any run of blanks and tabs.");
    std::string comment = map.comment == '\0' ? "" : std::string(1, map.comment);
    keys.text("comment", comment, "Lines that begin with this character are left out.");
    keys.require(comment.size() <= 1, "comment", fmt::format("comment = \"{}\"", comment), "one character");
    map.comment = comment.empty() ? '\0' : comment[0];
    keys.choice("decimal", map.decimal_comma, {{"point", false}, {"comma", true}},
                "Decimal sign of numbers.");
    keys.text("header", map.header,
              "First cell of the header's last line; empty: the first line that is no comment, or none where "
              "all columns are numbers.");
    keys.text("header_from", map.header_from,
              "A cell of the header's first line, among its first two; empty: as `header`.");
    unit_keys(keys, map);
    keys.columns(
        "columns", map.columns,
        "The column of each role, or of the roles of each stick: `t` or `frame` (neither: rows are frames), "
        "`stick` (a row a stick), `px py pz`, and one of `qw qx qy qz`, `ex ey ez` (with `euler`), `m00 m01 "
        ".. m22` (rotation matrix, row and column), or nothing. For a C3D file: `marker`, the tracked point, "
        "`marker2` towards the tip and `marker3` "
        "beside, with the labels of points. A column is its header's cell (of a header "
        "of several lines: the cells joined by '/'; '*' stands for anything, {stick} for a stick's name), "
        "#N: the N-th column, or +N: N columns right of the same stick's px; a - before it changes the sign. "
        "[columns.left] holds the roles "
        "of the stick left. Rotations turn body to world.",
        {.need = Need::given, .example = "{\"t\": \"Time\", \"px\": \"X\", \"py\": \"Y\", \"pz\": \"Z\"}"});
}
const TableKind<tracking::ColumnMap> kMapFile = {
    {"map",
     "A map file (TOML) for `musicworld trace convert --map`: where a table of another program keeps what a "
     "trace needs, and in which units and axes."},
    map_keys};

/// "t=Time,px=X": role by role.
tracking::ColumnMap spelt_out(const std::string& text) {
    tracking::ColumnMap map;
    std::stringstream rest(text);
    for (std::string part; std::getline(rest, part, ',');) {
        const std::size_t equals = part.find('=');
        if (equals == std::string::npos || equals == 0)
            throw BadInput(
                fmt::format("error: found \"{}\" in --map, expected ROLE=COLUMN such as px=X", part));
        if (!map.columns.emplace(part.substr(0, equals), part.substr(equals + 1)).second)
            throw BadInput(fmt::format("error: found {} twice in --map, expected each role once",
                                       part.substr(0, equals)));
    }
    return map;
}

}  // namespace

FormatDescription map_format() {
    return describe_format(kMapFile);
}

tracking::ColumnMap read_map(const fs::path& file) {
    tracking::ColumnMap map;
    read_toml({TomlFile("a map", file)}, "the map", [&](Fields& keys) { map_keys(keys, map); });
    try {
        map.check();
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("{}: {}", file.string(), wrong.what()));
    }
    return map;
}

std::string format_map(const tracking::ColumnMap& map) {
    toml::table top;
    const auto say = [&](const char* key, const std::string& value) {
        if (!value.empty()) top.insert(key, value);
    };
    say("signature", map.signature);
    say("separator", word_for(kSeparators, map.separator));
    if (map.comment != '\0') say("comment", std::string(1, map.comment));
    if (map.decimal_comma) say("decimal", "comma");
    say("header", map.header);
    say("header_from", map.header_from);
    if (map.metres_per_unit) say("units", word_for(kMetres, map.metres_per_unit));
    say("units_from", map.units_from);
    say("frame", map.frame);
    if (map.frame.empty()) say("up", map.z_up ? "z" : "y");
    say("euler", map.euler);
    if (map.radians) say("angles", "radians");
    say("time_unit", word_for(kSeconds, map.seconds_per_unit));
    if (map.from_zero) top.insert("from_zero", true);
    if (map.rate_hz > 0) top.insert("rate_hz", map.rate_hz);
    say("rate_from", map.rate_from);
    if (map.zero_is_lost) say("lost", "zeros");
    if (map.tip) top.insert("tip_m", toml::array{map.tip->x(), map.tip->y(), map.tip->z()});
    if (map.shaft) say("shaft", word_for(kAxes, map.shaft));
    toml::table columns;
    for (const auto& [role, column] : map.columns) {
        const std::size_t dot = role.rfind('.');
        toml::table* of = &columns;
        if (dot != std::string::npos)
            of = columns.insert(role.substr(0, dot), toml::table{}).first->second.as_table();
        of->insert(role.substr(dot == std::string::npos ? 0 : dot + 1), column);
    }
    top.insert("columns", columns);
    std::ostringstream out;
    out << "# What a table's columns mean; for `musicworld trace convert --map`.\n" << top << "\n";
    return out.str();
}

std::optional<tracking::ColumnMap> map_for(std::string_view text) {
    constexpr std::size_t kBeginning = 2000;
    for (const std::string& name : map_names()) {
        tracking::ColumnMap map = read_map(assets_folder() / "maps" / (name + ".toml"));
        if (!map.signature.empty() &&
            text.substr(0, kBeginning).find(map.signature) != std::string_view::npos)
            return map;
    }
    return std::nullopt;
}

tracking::ColumnMap find_map(const std::string& map) {
    return map.find('=') != std::string::npos ? spelt_out(map) : read_map(find_bundled(map, "maps"));
}

}  // namespace app
