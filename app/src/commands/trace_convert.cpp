#include "commands/trace_convert.h"

#include <fmt/format.h>
#include <tracking/import.h>

#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string_view>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/finished_file.h"
#include "files/option_values.h"
#include "traces/map_file.h"
#include "traces/sensor_model_options.h"
#include "traces/trace_warnings.h"

namespace app {
namespace {

struct ConvertArguments {
    std::vector<std::string> in;
    std::string out, map, save_map, units, up, euler, rate, separator, time_unit, header, sticks, tip, shaft,
        source;
    bool from_zero = false;
};

bool is_native(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    while (!text.empty() && (text[0] == '#' || text[0] == '\n' || text[0] == '\r'))
        text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
    return text.starts_with("t,stick,") || text.starts_with("t, stick,");
}

/// The map of these files, with the options in their places; none for traces that need none.
std::optional<tracking::ColumnMap> map_of(const ConvertArguments& a, const std::string& first_text) {
    std::optional<tracking::ColumnMap> map;
    if (!a.map.empty()) {
        map = find_map(a.map);
        const bool spelt_out = a.map.find('=') != std::string::npos;
        if (spelt_out && a.in.front().ends_with(".tsv")) map->separator = '\t';
    } else if (!is_native(first_text)) {
        map = map_for(first_text);
    }
    if (!map) return map;
    if (!a.units.empty()) map->metres_per_unit = metres_per(a.units, "--units"), map->units_from.clear();
    if (!a.up.empty()) map->z_up = a.up == "z";
    if (!a.euler.empty()) map->euler = a.euler;
    if (!a.rate.empty()) {
        map->rate_hz = parse_number(a.rate, "--rate");
        if (!(map->rate_hz > 0 && map->rate_hz <= 1e5))
            throw BadInput(fmt::format("error: found --rate {}, expected above 0 to 100000 Hz", a.rate));
    }
    if (!a.separator.empty()) map->separator = separator_called(a.separator, "--separator");
    if (!a.time_unit.empty()) map->seconds_per_unit = seconds_per(a.time_unit, "--time-unit");
    if (!a.header.empty()) map->header = a.header;
    if (a.from_zero) map->from_zero = true;
    map->check();
    return map;
}

/// The word after `Stick-` in a Vicon export's first line; empty without one.
std::string named_by_export(const std::string& file) {
    std::ifstream in(find_trace(file), std::ios::binary);
    std::string line;
    std::getline(in, line);
    while (!line.empty() && (line.back() == '\r' || line.back() == ',')) line.pop_back();
    constexpr std::string_view kMark = "Stick-";
    const bool marked = line.starts_with(kMark) && line.find(',') == std::string::npos;
    return marked ? line.substr(kMark.size()) : "";
}

/// --sticks; else what the exports call them, if all differ; else left and right, or stick.
std::vector<std::string> stick_names(const ConvertArguments& a) {
    std::vector<std::string> names;
    std::stringstream rest(a.sticks);
    for (std::string name; std::getline(rest, name, ',');) names.push_back(name);
    if (names.empty()) {
        for (const std::string& file : a.in)
            if (const std::string name = named_by_export(file); !name.empty()) names.push_back(name);
        const bool differ = std::set<std::string>(names.begin(), names.end()).size() == a.in.size();
        if (!differ) names.clear();
    }
    if (names.empty() && a.in.size() == 2) names = {"left", "right"};
    if (names.empty() && a.in.size() == 1) names = {"stick"};
    if (names.size() == a.in.size()) return names;
    throw BadInput(fmt::format("error: found {} files and {} names in --sticks, expected a name a file",
                               a.in.size(), names.size()));
}

/// Options that only a table of another program has a use for.
void refuse_map_options(const ConvertArguments& a) {
    const std::pair<const char*, bool> given[] = {
        {"--units", !a.units.empty()},         {"--up", !a.up.empty()},
        {"--euler", !a.euler.empty()},         {"--rate", !a.rate.empty()},
        {"--separator", !a.separator.empty()}, {"--time-unit", !a.time_unit.empty()},
        {"--header", !a.header.empty()},       {"--sticks", !a.sticks.empty()},
        {"--from-zero", a.from_zero},          {"--save-map", !a.save_map.empty()}};
    for (const auto& [option, is_given] : given)
        if (is_given)
            throw BadInput(
                fmt::format("{}: error: found {} with a trace that says this itself, expected a table "
                            "of another program; drop the option or say --map",
                            a.in.front(), option));
}

tracking::Trace read_inputs(const ConvertArguments& a) {
    const std::string first = tracking::read_bytes(find_trace(a.in.front()).string());
    const std::optional<tracking::ColumnMap> map = map_of(a, first);
    if (!map) {
        if (a.in.size() > 1)
            throw BadInput(fmt::format(
                "{}: error: found {} files, expected one trace, or tables of a known kind; say --map",
                a.in.front(), a.in.size()));
        refuse_map_options(a);
        return tracking::parse_trace(first, a.in.front());
    }
    if (!a.save_map.empty()) write_finished_file(a.save_map, format_map(*map));
    const std::vector<std::string> names = stick_names(a);
    std::vector<tracking::Table> tables;
    for (std::size_t i = 0; i < a.in.size(); ++i)
        tables.push_back({i == 0 ? first : tracking::read_bytes(a.in[i]), a.in[i], names[i]});
    return tracking::read_tables(tables, *map);
}

void convert(const ConvertArguments& a, const SensorArguments& sensor) {
    const tracking::SensorModel model = sensor_model(sensor);
    tracking::Trace trace = read_inputs(a);
    if (!a.tip.empty()) trace.tip = parse_vector(a.tip, "--tip");
    if (!a.shaft.empty()) trace.shaft = parse_axis(a.shaft, "--shaft");
    if (!a.source.empty()) trace.source = a.source;
    warn_of_implausible(trace);
    tracking::Trace seen = seen_by(trace, model);
    const std::string described = describe(model);
    if (!described.empty()) seen.source += (seen.source.empty() ? "" : "; ") + described;
    write_finished_file(a.out, tracking::format_trace(seen));
    for (const std::string& remark : trace.remarks) fmt::print("{}: {}\n", trace.file, remark);
    for (const tracking::StickTrace& stick : seen.sticks)
        fmt::print("{}: {}: {} samples from {:.6f} to {:.6f} s\n", a.out, stick.name, stick.samples.size(),
                   stick.samples.front().t_s, stick.samples.back().t_s);
}

void add_table_options(CLI::App& command, ConvertArguments& a) {
    const auto add = [&](const char* name, std::string& value, const std::string& help) {
        return command.add_option(name, value, help)->group("Tables of other programs");
    };
    add("--map", a.map,
        fmt::format("Columns: \"t=Time,px=X,..\", a TOML file, or one of {}", fmt::join(map_names(), ", ")));
    add("--save-map", a.save_map, "Write the map, with these options, to a TOML file");
    add("--units", a.units, "Of positions: m, cm or mm");
    add("--up", a.up, "Axis that points up: y or z")->check(CLI::IsMember({"y", "z"}));
    add("--euler", a.euler, "Order of the intrinsic turns ex, ey, ez, such as XYZ");
    add("--rate", a.rate, "Rows a second, where there is no column of times [Hz]");
    add("--separator", a.separator, "comma, semicolon, tab or space");
    add("--time-unit", a.time_unit, "s, ms, us or ns");
    add("--header", a.header, "First cell of the header's last line");
    add("--sticks", a.sticks, "Names for the files' sticks; two files: left,right");
    command.add_flag("--from-zero", a.from_zero, "Times count from the first row")
        ->group("Tables of other programs");
}

}  // namespace

void add_convert_command(CLI::App& trace) {
    CLI::App* command = trace.add_subcommand(
        "convert", "Make a trace of a recording of another program, or as another sensor would have seen it");
    auto a = std::make_shared<ConvertArguments>();
    command->add_option("IN", a->in, "Traces (CSV), Beat Saber replays (*.bsor), exports of other programs")
        ->required();
    command->add_option("--out", a->out, "Trace to write (CSV); replaced if there is one")->required();
    command->add_option("--tip", a->tip, "Tip in the tracked body's frame [m]: X,Y,Z");
    command->add_option("--shaft", a->shaft, "Body axis from hand to tip: -z, +y ...");
    command->add_option("--source", a->source, "What the trace's source key shall say");
    add_table_options(*command, *a);
    const std::shared_ptr<SensorArguments> sensor =
        add_sensor_options(*command, "--resample", Arrivals::in_order);
    command->callback([a, sensor] { convert(*a, *sensor); });
}

}  // namespace app
