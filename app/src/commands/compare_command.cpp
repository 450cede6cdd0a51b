#include "commands/compare_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "compare/compare.h"
#include "compare/comparison_report.h"
#include "compare/comparison_tables.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/option_values.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "process/parallel.h"
#include "process/progress_bar.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "traces/sensor_model_options.h"

namespace app {
namespace {

constexpr double kLongestLeadS = 1;

/// The options as typed.
struct CompareArguments {
    std::vector<std::string> traces, tune, predictions, persons;
    std::string predictors, leads = "1/30,1/15,1/10", kit, plane, out;
    bool no_tuning = false, no_cost = false, map = false;
};

double in_range(const std::string& text, const std::string& option, double least, double most) {
    const double value = parse_number(text, option);
    if (!(value >= least && value <= most))
        throw BadInput(fmt::format("error: found {} {}, expected {} to {}", option, text, least, most));
    return value;
}

std::vector<double> leads_of(const std::string& text) {
    std::vector<double> leads;
    for (const std::string& part : split_at_commas(text)) {
        const double lead = in_range(part, "--leads", 0, kLongestLeadS);
        if (std::find(leads.begin(), leads.end(), lead) != leads.end())
            throw BadInput(
                fmt::format("error: found --leads {} with {} twice, expected each lead once", text, part));
        leads.push_back(lead);
    }
    return leads;
}

std::vector<std::string> predictors_of(const std::string& list) {
    if (!list.empty()) return split_specifications(list);
    std::vector<std::string> all = {"auto"};
    for (const std::string& name : tracking::predictor_names())
        if (name != "auto") all.push_back(name);
    return all;
}

/// NAME=VALUE pairs; the last `=` parts them if `at_last`, else the first.
std::vector<std::pair<std::string, std::string>> pairs_of(const std::vector<std::string>& texts,
                                                          const std::string& option, bool at_last) {
    std::vector<std::pair<std::string, std::string>> pairs;
    for (const std::string& text : texts) {
        const std::size_t equals = at_last ? text.rfind('=') : text.find('=');
        if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
            throw BadInput(fmt::format("error: found {} \"{}\", expected {}", option, text,
                                       at_last ? "TEXT=NAME" : "NAME=FILE"));
        pairs.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    }
    return pairs;
}

StrikeSurface surface_of(const CompareArguments& a) {
    StrikeSurface surface;
    constexpr std::string_view kContact = "contact";
    if (!a.kit.empty()) {
        surface.kind = StrikeSurface::Kind::kit;
        surface.kit = read_kit(find_kit(a.kit));
    } else if (a.plane.starts_with(kContact)) {
        surface.kind = StrikeSurface::Kind::above_contact;
        const std::string above = a.plane.substr(kContact.size());
        if (!above.empty() && above[0] != '+' && above[0] != '-')
            throw BadInput(fmt::format("error: found --plane {}, expected a height or contact+D", a.plane));
        if (!above.empty())
            surface.height_m = (above[0] == '-' ? -1 : 1) * in_range(above.substr(1), "--plane", 0, 10);
    } else if (!a.plane.empty()) {
        surface.kind = StrikeSurface::Kind::plane;
        surface.height_m = in_range(a.plane, "--plane", -1000, 1000);
    }
    return surface;
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

ComparisonOptions options_of(const CompareArguments& a, const SensorArguments& sensor) {
    ComparisonOptions o;
    o.traces = found_traces(a.traces);
    o.tune_traces = found_traces(a.tune);
    o.predictors = predictors_of(a.predictors);
    o.predictions = pairs_of(a.predictions, "--predictions", false);
    o.persons = pairs_of(a.persons, "--person", true);
    o.leads_s = leads_of(a.leads);
    o.sensor = sensor_model(sensor);
    o.surface = surface_of(a);
    o.surface_text = !a.kit.empty() ? "kit " + a.kit : a.plane.empty() ? "none" : "plane " + a.plane;
    o.tuning = !a.no_tuning;
    o.cost = !a.no_cost;
    o.map = a.map;
    o.threads = worthwhile_threads();
    return o;
}

void run(const CompareArguments& a, const SensorArguments& sensor) {
    ComparisonOptions options = options_of(a, sensor);
    OutputFolder out(a.out, compare_products());
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

void add_compare_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand(
        "compare", "Compare predictors on recordings: errors, strikes, cost, every predictor at every lead");
    auto a = std::make_shared<CompareArguments>();
    command->add_option("TRACE", a->traces, "Traces (CSV), or names of bundled ones")->required();
    command->add_option("--predictors", a->predictors, "Predictors, separated by commas (default: all)");
    command->add_option("--leads", a->leads, "Leads [s], separated by commas")->capture_default_str();
    CLI::Option* kit =
        command->add_option("--kit", a->kit, "Score strikes on the instruments of a kit: its name or file");
    command
        ->add_option(
            "--plane", a->plane,
            "Score strikes on a level plane: its height [m], or contact+D or contact-D: D [m] from each "
            "stick's contact height, the median low of its tip")
        ->excludes(kit);
    command->add_option(
        "--tune", a->tune,
        "Tune, and learn the advance of auto's strikes, on these traces (without the one scored) "
        "instead of on the others compared; --map does not use them");
    command->add_option("--predictions", a->predictions,
                        "NAME=FILE[@TRACE]: predictions made elsewhere, in predict's format");
    command->add_option("--person", a->persons, "TEXT=NAME: traces whose path contains TEXT are of NAME");
    command->add_flag("--no-tuning", a->no_tuning, "Run the predictors as named only");
    command->add_flag("--no-cost", a->no_cost, "Measure no cost: the results are then the same on every run");
    command->add_flag("--map", a->map, "Also map 30 to 240 Hz x noise x jitter x drop-outs (minutes)");
    command->add_option("--out", a->out, "Folder for compare.json, compare.csv, report.html")->required();
    const std::shared_ptr<SensorArguments> sensor = add_sensor_options(*command);
    command->callback([a, sensor] { run(*a, *sensor); });
}

}  // namespace app
