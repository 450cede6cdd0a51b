#include <fmt/format.h>
#include <tracking/import.h>
#include <tracking/input.h>

#include <memory>
#include <optional>
#include <set>
#include <string_view>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/sensor_model_options.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "sticks/trace_warnings.h"
#include "traces/map_file.h"
#include "traces/sensor_model.h"

namespace app {
namespace {

struct ConvertOptions {
    std::vector<std::string> in, sticks;
    std::string out, map, save_map, source;
    std::optional<std::string> euler, header, frame;
    std::optional<double> metres_per_unit, seconds_per_unit, rate_hz;
    std::optional<bool> z_up, decimal_comma;
    std::optional<char> separator;
    std::optional<Eigen::Vector3d> tip, shaft;
    bool from_zero = false;
    tracking::SensorModel sensor;
    std::vector<CLI::Option*> of_tables;  ///< that only a table of another program has a use for
};

bool is_native(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    while (!text.empty() && (text[0] == '#' || text[0] == '\n' || text[0] == '\r'))
        text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
    return text.starts_with("t,stick,") || text.starts_with("t, stick,");
}

/// The map of these files, with the options in their places; none for traces that need none. C3D files need none, but
/// may have one.
std::optional<tracking::ColumnMap> map_of(const ConvertOptions& o, const std::string& first_text) {
    std::optional<tracking::ColumnMap> map;
    if (!o.map.empty()) {
        map = find_map(o.map);
        const bool spelt_out = o.map.find('=') != std::string::npos;
        if (spelt_out && o.in.front().ends_with(".tsv")) map->separator = '\t';
    } else if (tracking::is_c3d(first_text)) {
        map.emplace();
    } else if (!is_native(first_text)) {
        map = map_for(first_text);
    }
    if (!map) return map;
    if (o.metres_per_unit) map->metres_per_unit = *o.metres_per_unit, map->units_from.clear();
    if (o.rate_hz) map->rate_hz = *o.rate_hz;
    if (o.z_up) map->z_up = *o.z_up, map->frame.clear();
    if (o.frame) map->frame = *o.frame, map->z_up = o.z_up.value_or(false);
    map->decimal_comma = o.decimal_comma.value_or(map->decimal_comma);
    map->euler = o.euler.value_or(map->euler);
    map->separator = o.separator.value_or(map->separator);
    map->seconds_per_unit = o.seconds_per_unit.value_or(map->seconds_per_unit);
    map->header = o.header.value_or(map->header);
    if (o.from_zero) map->from_zero = true;
    if (o.tip) map->tip = o.tip;
    if (o.shaft) map->shaft = o.shaft;
    if (!map->columns.empty()) map->check();
    return map;
}

/// The word after `Stick-` in a Vicon export's first line; empty without one.
std::string named_by_export(std::string_view text) {
    std::string line(text.substr(0, text.find('\n')));
    while (!line.empty() && (line.back() == '\r' || line.back() == ',')) line.pop_back();
    constexpr std::string_view kMark = "Stick-";
    const bool marked = line.starts_with(kMark) && line.find(',') == std::string::npos;
    return marked ? line.substr(kMark.size()) : "";
}

/// --sticks; else what the exports call them, if all differ; else left and right, or stick.
std::vector<std::string> stick_names(const ConvertOptions& o, const std::vector<std::string>& texts) {
    std::vector<std::string> names = o.sticks;
    if (names.empty()) {
        for (const std::string& text : texts)
            if (const std::string name = named_by_export(text); !name.empty()) names.push_back(name);
        const bool differ = std::set<std::string>(names.begin(), names.end()).size() == o.in.size();
        if (!differ) names.clear();
    }
    if (names.empty() && o.in.size() == 2) names = {"left", "right"};
    if (names.empty() && o.in.size() == 1) names = {"stick"};
    if (names.size() == o.in.size()) return names;
    refuse_options(fmt::format("{} files and {} names in --sticks", o.in.size(), names.size()),
                   "a name per file");
}

void refuse_table_options(const ConvertOptions& o) {
    for (const CLI::Option* option : o.of_tables)
        if (option->count() > 0)
            throw BadInput(
                fmt::format("{}: error: found {} with a trace that says this itself, expected a table "
                            "of another program; drop the option or say --map",
                            o.in.front(), option->get_name()));
}

tracking::Trace read_c3d(const ConvertOptions& o, const std::string& bytes, const tracking::ColumnMap& map) {
    if (!tracking::is_c3d(bytes))
        throw BadInput(
            fmt::format("{}: error: found a map of markers for another file, expected a C3D file; map "
                        "its columns (px=...)",
                        o.in.front()));
    if (o.in.size() > 1 || !o.sticks.empty())
        refuse_options("several files or --sticks with a C3D file", "one file and its markers (--map)");
    return tracking::read_markers(bytes, o.in.front(), map);
}

tracking::Trace read_inputs(const ConvertOptions& o) {
    std::vector<std::string> texts;  // each file is read once: it may be a pipe
    texts.push_back(tracking::read_bytes(find_trace(o.in.front()).string()));
    const std::optional<tracking::ColumnMap> map = map_of(o, texts.front());
    if (!map) {
        if (o.in.size() > 1)
            throw BadInput(fmt::format(
                "{}: error: found {} files, expected one trace, or tables of a known kind; say --map",
                o.in.front(), o.in.size()));
        refuse_table_options(o);
        return tracking::parse_trace(texts.front(), o.in.front());
    }
    if (!o.save_map.empty() && map->columns.empty())
        refuse_options("--save-map without --map", "a map of the markers");
    if (!o.save_map.empty()) write_finished_file(o.save_map, format_map(*map));
    if (tracking::is_c3d(texts.front()) || map->of_markers()) return read_c3d(o, texts.front(), *map);
    for (std::size_t i = 1; i < o.in.size(); ++i)
        texts.push_back(tracking::read_bytes(find_trace(o.in[i]).string()));
    const std::vector<std::string> names = stick_names(o, texts);
    std::vector<tracking::Table> tables;
    for (std::size_t i = 0; i < o.in.size(); ++i) tables.push_back({texts[i], o.in[i], names[i]});
    return tracking::read_tables(tables, *map);
}

void convert(const ConvertOptions& o) {
    std::vector<std::filesystem::path> inputs;
    for (const std::string& name : o.in) inputs.push_back(find_trace(name));
    refuse_replacing(o.out, inputs);
    if (!o.save_map.empty()) refuse_replacing(o.save_map, inputs);
    tracking::Trace trace = read_inputs(o);
    if (o.tip) trace.tip = *o.tip;
    if (o.shaft) trace.shaft = *o.shaft;
    if (!o.source.empty()) trace.source = o.source;
    warn_of_implausible(trace);
    tracking::Trace seen = seen_by(trace, o.sensor);
    const std::string described = describe(o.sensor);
    if (!described.empty()) seen.source += (seen.source.empty() ? "" : "; ") + described;
    write_finished_file(o.out, tracking::format_trace(seen));
    for (const std::string& remark : trace.remarks) fmt::print("{}: {}\n", trace.file, remark);
    for (const tracking::StickTrace& stick : seen.sticks)
        fmt::print("{}: {}: {} from {:.9g} to {:.9g} s\n", o.out, stick.name,
                   counted(stick.samples.size(), "sample"), stick.samples.front().t_s,
                   stick.samples.back().t_s);
}

void add_table_options(Command& command, ConvertOptions& o) {
    constexpr const char* kHeading = "Tables of other programs";
    Command tables = command.under(kHeading);
    tables.option("--map", o.map, as::text("MAP"),
                  "Columns: \"t=Time,px=X,pz=-Z,..\", markers: \"left.marker=LABEL,..\", a TOML file, or a "
                  "bundled map such as "
                  "optitrack");
    tables.option("--save-map", o.save_map, as::text("FILE"),
                  "Write the map, with these options, to a TOML file");
    tables.option("--units", o.metres_per_unit, as::choice<double>({{"m", 1}, {"cm", 0.01}, {"mm", 0.001}}),
                  "Of positions");
    tables.option("--up", o.z_up, as::choice<bool>({{"y", false}, {"z", true}}), "Axis that points up");
    tables.option(
        "--frame", o.frame, as::text("AXES"),
        "Where x, y and z point, in place of --up: unity, unreal, or three letters such as RUF (right, "
        "up, forward)");
    tables.option("--euler", o.euler, as::text("ORDER"),
                  "Order of the intrinsic turns ex, ey, ez, such as XYZ");
    tables.option("--rate", o.rate_hz, as::number_above(0, 1e5, "Hz"),
                  "Rows per second, where there is no column of times");
    tables.option("--separator", o.separator,
                  as::choice<char>({{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"space", ' '}}),
                  "Between the cells");
    tables.option("--decimal", o.decimal_comma, as::choice<bool>({{"point", false}, {"comma", true}}),
                  "Sign before the fractions of numbers");
    tables.option("--time-unit", o.seconds_per_unit,
                  as::choice<double>({{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}), "Of times");
    tables.option("--header", o.header, as::text("CELL"), "First cell of the header's last line");
    tables.option("--sticks", o.sticks, as::list_of(as::text("NAME")),
                  "Names for the files' sticks; two files: left,right");
    tables.flag("--from-zero", o.from_zero, "Times count from the first row");
    o.of_tables =
        command->get_options([](const CLI::Option* option) { return option->get_group() == kHeading; });
}

}  // namespace

void add_convert_command(Command& trace) {
    Command command = trace.command(
        "convert", "Make a trace of a recording of another program, or as another sensor would have seen it");
    auto o = std::make_shared<ConvertOptions>();
    command
        .options("IN", o->in, as::text("IN"),
                 "Traces (CSV), Beat Saber replays (*.bsor), *.xror, *.c3d, exports of other programs")
        ->required();
    command.required("--out", o->out, as::text("FILE"), "Trace to write (CSV); replaced if there is one");
    command.option("--tip", o->tip, as::vector_of_3(as::number(-1000, 1000, "m")),
                   "Tip in the tracked body's frame");
    command.option("--shaft", o->shaft, as::axis(), "Body axis from hand to tip");
    command.option("--source", o->source, as::text("TEXT"), "What the trace's source key shall say");
    add_table_options(command, *o);
    add_sensor_model_options(command, o->sensor, "--resample", Arrivals::in_order);
    command.runs([o] { convert(*o); });
}

}  // namespace app
