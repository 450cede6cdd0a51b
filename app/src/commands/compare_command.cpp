#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/sensor_model_options.h"
#include "compare/comparison.h"
#include "compare/comparison_tables.h"
#include "compare/experiment.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "process/parallel.h"
#include "process/progress_bar.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
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

/// What an experiment repeats.
std::shared_ptr<ComparisonOptions> declare_comparison(Command& command) {
    auto o = std::make_shared<ComparisonOptions>();
    o->predictors = all_predictors();
    o->leads_s = {1.0 / 30, 1.0 / 15, 1.0 / 10};
    o->surface_text = "none";
    const auto trace = as::text("TRACE");
    command.options("TRACE", o->traces, trace, "Traces (CSV), or names of bundled ones");
    command.option<std::string>(
        "--predictors", as::text("PREDICTOR,..."), "Predictors, separated by commas",
        [o = o.get()](const std::string& list) { o->predictors = split_specifications(list); }, "all");
    command.option("--leads", o->leads_s, as::list_of(as::number(0, 1, "s")), "Leads");
    CLI::Option* kit = command.option<std::string>(
        "--kit", as::text("KIT"), "Score strikes on the instruments of a kit: its name or file",
        [o = o.get()](const std::string& name) {
            o->surface = {StrikeSurface::Kind::kit, 0, read_kit(find_kit(name))};
            o->surface_text = "kit " + name;
        });
    command
        .option<std::string>(
            "--plane", as::text("HEIGHT"),
            "Score strikes on a level plane: its height [m], or contact+D or contact-D: D [m] from "
            "each stick's contact height, the median low of its tip",
            [o = o.get()](const std::string& text) {
                o->surface = read_plane(text);
                o->surface_text = "plane " + text;
            })
        ->excludes(kit);
    command.option("--false-cost", o->false_cost, as::number(0.01, 100),
                   "What a false sound costs where a missed strike costs 1");
    CLI::Option* tune = command.options(
        "--tune", o->tune_traces, trace,
        "Tune, and learn the advance of auto's strikes, on these traces (without the one scored) "
        "instead of on the others compared; --map does not use them");
    command
        .options(
            "--transfer", o->transfer, as::text("PERSON|TRACE"),
            "Train a network on these persons' recordings, or traces, tune on them, and score the others")
        ->excludes(tune);
    command.options("--predictions", o->predictions, as::named("NAME=FILE[@TRACE]"),
                    "Predictions made elsewhere, in predict's format");
    command.options("--person", o->persons, as::named("TEXT=NAME", as::PartedAt::last),
                    "Traces whose path contains TEXT are of NAME");
    command.flag("--no-tuning", o->tuning, "Run the predictors as named only", false);
    command.flag("--no-cost", o->cost, "Measure no cost: the results are then the same on every run", false);
    command.flag("--map", o->map, "Also map 30 to 240 Hz x noise x jitter x drop-outs (minutes)");
    add_sensor_model_options(command, o->sensor);
    return o;
}

/// The comparison of an experiment. Names of files begin in its folder from here on.
ComparisonOptions read_options(const fs::path& file) {
    const Experiment experiment = read_experiment(file);
    fs::current_path(experiment.folder);
    CLI::App line("", "compare");
    Command command(line);
    const std::shared_ptr<ComparisonOptions> options = declare_comparison(command);
    command.runs([] {});
    try {
        line.parse(std::vector<std::string>(experiment.arguments.rbegin(), experiment.arguments.rend()));
    } catch (const CLI::ParseError& wrong) {
        throw BadInput(
            fmt::format("{}: error: found arguments that compare does not know ({}), expected those "
                        "of an experiment.toml; mend `arguments`",
                        file.string(), wrong.what()));
    }
    options->arguments = command.given_but({});
    return *options;
}

void run(ComparisonOptions options, const fs::path& folder) {
    options.traces = found_traces(options.traces);
    options.tune_traces = found_traces(options.tune_traces);
    options.threads = worthwhile_threads();
    require_gnuplot();
    OutputFolder out(folder, kCompareProducts);
    if (options.samples) OutputFile{*options.samples};  // refused before minutes have passed
    ProgressBar bar(true);
    options.progress = [&bar](double share) { bar.show(share); };
    const Comparison comparison = compare(options);
    write_file(out.path("compare.json"), format_comparison_json(comparison));
    write_file(out.path("compare.csv"), csv_table(comparison).csv());
    out.adorn("figures", [&] { fs::create_directory(out.path("figures")); });
    write_page(out, "report.html", [&](Plotter& plotter) {
        return format_comparison_report(comparison, plotter, out.path("figures"));
    });
    write_file(out.path("experiment.toml"),
               format_experiment(
                   {MUSICWORLD_VERSION, fs::current_path().string(), options.arguments, comparison.inputs}));
    out.finish();
    bar.clear();
    fmt::print("{}", format_comparison_text(comparison));
    throw_if_any(out.failures(), folder);
}

}  // namespace

void add_compare_command(Command& program) {
    Command command = program.command(
        "compare", "Compare predictors on recordings: errors, strikes, cost, every predictor at every lead");
    const std::shared_ptr<ComparisonOptions> o = declare_comparison(command);
    struct Files {
        std::string out;
        std::optional<std::string> samples, experiment;
    };
    const auto files = std::make_shared<Files>();
    command.required("--out", files->out, as::text("DIR"),
                     "Folder for compare.json, compare.csv, report.html, figures, experiment.toml");
    command.option("--samples", files->samples, as::text("FILE"),
                   "Also write the error of every single prediction (CSV)");
    command.option("--experiment", files->experiment, as::text("FILE"),
                   "Repeat the comparison of an experiment.toml, with the same files, in place of TRACE...");
    command.runs([o, files, command] {
        const std::vector<std::string> given = command.given_but({"--out", "--samples", "--experiment"});
        if (files->experiment && !given.empty())
            refuse_options("--experiment with " + given.front(), "--out and --samples at most beside it");
        if (!files->experiment && o->traces.empty())
            refuse_options("no TRACE", "one, or --experiment; see `musicworld compare --help`");
        const fs::path folder = fs::absolute(files->out);
        if (files->samples) files->samples = fs::absolute(*files->samples).string();
        o->arguments = given;
        ComparisonOptions options = files->experiment ? read_options(*files->experiment) : *o;
        options.samples = files->samples;
        run(std::move(options), folder);
    });
}

}  // namespace app
