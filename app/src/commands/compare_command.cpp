#include <fmt/format.h>

#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/sensor_model_options.h"
#include "compare/comparison.h"
#include "compare/comparison_tables.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "process/parallel.h"
#include "process/progress_bar.h"
#include "sticks/predictors.h"

namespace app {
namespace {

std::vector<std::string> all_predictors() {
    std::vector<std::string> all = {"auto"};
    std::ranges::copy(tracking::predictor_names(), std::back_inserter(all));
    all.emplace_back("learned");
    return all;
}

/// "contact+0.02", "contact" or a height [m].
StrikeSurface read_plane(const std::string& text) {
    constexpr std::string_view kContact = "contact";
    if (!text.starts_with(kContact))
        return {StrikeSurface::Kind::plane,
                as::number(-1000, 1000, "m, or contact+D").parse(text, "--plane"),
                {}};
    const std::string above = text.substr(kContact.size());
    if (above.empty()) return {StrikeSurface::Kind::above_contact, 0, {}};
    const std::optional<double> distance = as::number(0, 10).read(above.substr(1));
    if (!distance || (above[0] != '+' && above[0] != '-'))
        refuse_value("--plane", text, "a height, contact+D or contact-D with D from 0 to 10 m");
    return {StrikeSurface::Kind::above_contact, above[0] == '-' ? -*distance : *distance, {}};
}

/// Paths of traces, or of bundled ones by name. What lies beside traces (TRACE.hits.csv, TRACE.flags.csv) is
/// passed over, so that `takes/*.csv` means the takes.
std::vector<std::string> found_traces(const std::vector<std::string>& names) {
    std::vector<std::string> files;
    for (const std::string& name : names)
        if (!name.ends_with(".hits.csv") && !name.ends_with(".flags.csv"))
            files.push_back(find_trace(name).string());
    if (files.empty() && !names.empty())
        throw BadInput(
            fmt::format("{}: error: found marks that belong to a trace, expected a trace; name "
                        "the trace itself",
                        names.front()));
    return files;
}

struct CompareOptions : ComparisonOptions {
    std::string out;
};

void run(CompareOptions options) {
    options.traces = found_traces(options.traces);
    options.tune_traces = found_traces(options.tune_traces);
    options.threads = worthwhile_threads();
    OutputFolder out(options.out, kCompareProducts);
    ProgressBar bar(true);
    options.progress = [&bar](double share) { bar.show(share); };
    const Comparison comparison = compare(options);
    write_file(out.path("compare.json"), format_comparison_json(comparison));
    write_file(out.path("compare.csv"), result_table(comparison).csv());
    write_file(out.path("report.html"), format_comparison_report(comparison, out.scratch()));
    out.finish();
    bar.clear();
    fmt::print("{}", format_comparison_text(comparison));
}

}  // namespace

void add_compare_command(Command& program) {
    Command command = program.command(
        "compare", "Compare predictors on recordings: errors, strikes, cost, every predictor at every lead");
    auto o = std::make_shared<CompareOptions>();
    o->predictors = all_predictors();
    o->leads_s = {1.0 / 30, 1.0 / 15, 1.0 / 10};
    o->surface_text = "none";
    const auto trace = as::text("TRACE");
    command.options("TRACE", o->traces, trace, "Traces (CSV), or names of bundled ones")->required();
    command.option<std::string>(
        "--predictors", as::text("PREDICTOR,..."), "Predictors, separated by commas",
        [o](const std::string& list) { o->predictors = split_specifications(list); }, "all");
    command.option("--leads", o->leads_s, as::list_of(as::number(0, 1, "s")), "Leads");
    CLI::Option* kit = command.option<std::string>(
        "--kit", as::text("KIT"), "Score strikes on the instruments of a kit: its name or file",
        [o](const std::string& name) {
            o->surface = {StrikeSurface::Kind::kit, 0, read_kit(find_kit(name))};
            o->surface_text = "kit " + name;
        });
    command
        .option<std::string>(
            "--plane", as::text("HEIGHT"),
            "Score strikes on a level plane: its height [m], or contact+D or contact-D: D [m] from "
            "each stick's contact height, the median low of its tip",
            [o](const std::string& text) {
                o->surface = read_plane(text);
                o->surface_text = "plane " + text;
            })
        ->excludes(kit);
    command.options("--tune", o->tune_traces, trace,
                    "Tune, and learn the advance of auto's strikes, on these traces (without the one scored) "
                    "instead of on the others compared; --map does not use them");
    command.options("--predictions", o->predictions, as::named("NAME=FILE[@TRACE]"),
                    "Predictions made elsewhere, in predict's format");
    command.options("--person", o->persons, as::named("TEXT=NAME", as::PartedAt::last),
                    "Traces whose path contains TEXT are of NAME");
    command.flag("--no-tuning", o->tuning, "Run the predictors as named only", false);
    command.flag("--no-cost", o->cost, "Measure no cost: the results are then the same on every run", false);
    command.flag("--map", o->map, "Also map 30 to 240 Hz x noise x jitter x drop-outs (minutes)");
    command.required("--out", o->out, as::text("DIR"), "Folder for compare.json, compare.csv, report.html");
    add_sensor_model_options(command, o->sensor);
    command.runs([o] { run(*o); });
}

}  // namespace app
