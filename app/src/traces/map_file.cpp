#include "traces/map_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/option_values.h"
#include "files/toml_reader.h"
#include "kit/kit.h"

namespace fs = std::filesystem;

namespace app {
namespace {

/// A word of a map file and what it stands for.
template <class Value>
using Words = std::vector<std::pair<std::string, Value>>;

const Words<double> kMetres = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}};
const Words<double> kSeconds = {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
const Words<char> kSeparators = {{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"space", ' '}};

template <class Value>
Value meaning(const Words<Value>& words, const std::string& word, const std::string& option) {
    std::string known;
    for (const auto& [name, value] : words) {
        if (name == word) return value;
        known += (known.empty() ? "" : ", ") + name;
    }
    throw BadInput(fmt::format("error: found {} \"{}\", expected one of {}", option, word, known));
}

template <class Value>
std::string word_for(const Words<Value>& words, Value value) {
    for (const auto& [name, meant] : words)
        if (meant == value) return name;
    return words.front().first;
}

toml::table parse(const fs::path& file) {
    std::ifstream in(file);
    std::error_code ignored;
    if (!in.good() || fs::is_directory(file, ignored))
        throw BadInput(fmt::format(
            "{}: error: found no readable file, expected a map: NAME=COLUMN,.., a TOML file, or one of {}",
            file.string(), fmt::join(map_names(), ", ")));
    try {
        return toml::parse(in, file.string());
    } catch (const toml::parse_error& wrong) {
        std::string what(wrong.description());
        std::replace(what.begin(), what.end(), '\n', ' ');
        throw BadInput(fmt::format("{}:{}:{}: error: found a syntax error ({}), expected TOML", file.string(),
                                   wrong.source().begin.line, wrong.source().begin.column, what));
    }
}

/// [columns]: role = "column", or a table of them for each stick.
void read_columns(const toml::table& table, const std::string& prefix, tracking::ColumnMap& map) {
    for (const auto& [key, node] : table) {
        const std::string role = prefix + std::string(key.str());
        if (node.is_table() && prefix.empty())
            read_columns(*node.as_table(), role + ".", map);
        else if (node.is_string())
            map.columns[role] = node.as_string()->get();
        else
            fail_at(node.source(), fmt::format("no text for column \"{}\"", role),
                    "a column's name in quotes, #N or +N");
    }
}

void read_units(TomlReader& top, tracking::ColumnMap& map) {
    map.metres_per_unit = meaning(kMetres, top.choice("units", {"m", "cm", "mm"}, "m"), "units");
    map.units_from = top.text("units_from", "");
    map.z_up = top.choice("up", {"y", "z"}, "y") == "z";
    map.euler = top.choice("euler", {"", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}, "");
    map.radians = top.choice("angles", {"degrees", "radians"}, "degrees") == "radians";
    map.seconds_per_unit =
        meaning(kSeconds, top.choice("time_unit", {"s", "ms", "us", "ns"}, "s"), "time_unit");
    map.from_zero = top.flag("from_zero", false);
    map.rate_hz = top.number("rate_hz", 0, 1e5, 0.0);
    map.rate_from = top.text("rate_from", "");
    map.zero_is_lost = top.choice("lost", {"empty", "zeros"}, "empty") == "zeros";
    if (top.has("tip_m")) map.tip = top.vector("tip_m", -3, 3);
    if (top.has("shaft"))
        map.shaft = as::axis().parse(top.choice("shaft", {"+x", "-x", "+y", "-y", "+z", "-z"}), "shaft");
}

std::string axis_word(const Eigen::Vector3d& shaft) {
    Eigen::Index axis = 0;
    const double size = shaft.cwiseAbs().maxCoeff(&axis);
    return std::string(shaft[axis] < 0 && size > 0 ? "-" : "+") + "xyz"[axis];
}

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

tracking::ColumnMap read_map(const fs::path& file) {
    const toml::table table = parse(file);
    TomlReader top({&table}, "the map");
    tracking::ColumnMap map;
    static_cast<void>(top.text("description", ""));
    map.signature = top.text("signature", "");
    map.separator = meaning(
        kSeparators, top.choice("separator", {"comma", "semicolon", "tab", "space"}, "comma"), "separator");
    const std::string comment = top.text("comment", "");
    if (comment.size() > 1) top.fail("comment", fmt::format("comment = \"{}\"", comment), "one character");
    map.comment = comment.empty() ? '\0' : comment[0];
    map.decimal_comma = top.choice("decimal", {"point", "comma"}, "point") == "comma";
    map.header = top.text("header", "");
    map.header_from = top.text("header_from", "");
    read_units(top, map);
    static_cast<void>(top.table("columns"));
    top.done();
    if (const toml::table* columns = table["columns"].as_table()) read_columns(*columns, "", map);
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
    say("units", word_for(kMetres, map.metres_per_unit));
    say("units_from", map.units_from);
    say("up", map.z_up ? "z" : "y");
    say("euler", map.euler);
    if (map.radians) say("angles", "radians");
    say("time_unit", word_for(kSeconds, map.seconds_per_unit));
    if (map.from_zero) top.insert("from_zero", true);
    if (map.rate_hz > 0) top.insert("rate_hz", map.rate_hz);
    say("rate_from", map.rate_from);
    if (map.zero_is_lost) say("lost", "zeros");
    if (map.tip) top.insert("tip_m", toml::array{map.tip->x(), map.tip->y(), map.tip->z()});
    if (map.shaft) say("shaft", axis_word(*map.shaft));
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

std::vector<std::string> map_names() {
    std::vector<std::string> names;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(assets_folder() / "maps", ignored))
        if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
    std::sort(names.begin(), names.end());
    return names;
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
    if (map.find('=') != std::string::npos) return spelt_out(map);
    const fs::path bundled = assets_folder() / "maps" / (map + ".toml");
    std::error_code ignored;
    if (map.find('/') == std::string::npos && fs::is_regular_file(bundled, ignored)) return read_map(bundled);
    return read_map(map);
}

}  // namespace app
