// musicworld_bench, which `musicworld bench` becomes: our speed beside peers', and what accuracy costs.
#include <falling_bodies.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/bench_hard.h"
#include "bench/bench_report.h"
#include "bench/bench_sim.h"
#include "bench/bench_tradeoff.h"
#include "bench/bench_workers.h"
#include "command_line.h"
#include "commands/command.h"
#include "commands/worker_options.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "process/child_process.h"
#include "report/plot.h"
#include "scene/scene.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct BenchOptions {
    std::string name, out;
    SimBenchOptions sim;
    WorkersBenchOptions workers;
    HardBenchOptions hard;
    bool json = false;
};

/// A benchmark's figures as text and as one JSON document, and what else goes into its folder, by file name.
struct Figures {
    std::string text, json;
    std::map<std::string, std::string> tables = {};
    std::map<std::string, PlotScript> plots = {};
    /// A page with plots of its own, by file name; drawn in an existing folder.
    std::map<std::string, std::function<std::string(const fs::path& scratch)>> pages = {};
};

struct Bench {
    std::string name;
    std::vector<std::string_view> products;  ///< of its folder; the first is the JSON document
    Figures (*measure)(const std::string& name, const BenchOptions& options);
};

void say(const std::string& line) {
    fmt::print(stderr, "{}\n", line);
}

/// A bundled or own scene of balls, for Bullet to have the same.
SimBenchOptions::Scene balls_of(const std::string& name) {
    Scene scene = read_scene(find_scene(name));
    if (scene.world.bodies.empty() || scene.world.planes.empty())
        throw BadInput(
            fmt::format("{}: error: found no bodies or no planes, expected balls of one kind in a box",
                        scene.file.string()));
    for (const sim::WorldBody& body : scene.world.bodies)
        if (!sim_bench::is_benchmark_ball(body))
            throw BadInput(
                fmt::format("{}: error: found body '{}', expected balls of 0.5 m with modes, as Bullet's",
                            scene.file.string(), body.name));
    scene.world.constraints.clear();
    scene.world.settings.sleeping = false;
    return {scene.name, scene.world};
}

Figures bench_the_simulation(const std::string&, const BenchOptions& options) {
    const BenchReport report = bench_sim(options.sim, say);
    return {format_text(report), format_json(report)};
}

Figures bench_the_tradeoff(const std::string&, const BenchOptions&) {
    const Tradeoff measured = measure_tradeoff(all_tradeoff_settings(), kConverged, kFiner, say);
    return {format_text(measured),
            format_json(measured),
            {{"tradeoff.csv", format_csv(measured)}},
            {{"tradeoff.svg", {900, 560, plot_commands(measured)}}}};
}

Figures bench_the_hard_scenes(const std::string&, const BenchOptions& options) {
    const HardBench measured = bench_hard(options.hard, say);
    return {format_text(measured),
            format_json(measured),
            {{"hard.csv", format_csv(measured)}},
            {{"hard.svg", hard_plot(measured)}},
            {{"hard.html", [measured](const fs::path& scratch) { return format_page(measured, scratch); }}}};
}

Figures bench_the_workers(const std::string&, const BenchOptions& options) {
    const WorkersBench measured = bench_workers(options.workers, say);
    Figures figures{format_text(measured), format_json(measured.report)};
    if (!measured.speed_ups.empty()) figures.tables["speed_up.csv"] = speed_up_csv(measured.speed_ups);
    for (const SpeedUp& s : measured.speed_ups)
        figures.plots[fmt::format("speed_up/bodies{}.svg", s.bodies)] = speed_up_plot(s);
    if (!measured.bounds.empty()) figures.tables["bound.csv"] = bound_csv(measured.bounds);
    if (!measured.migration.workers().empty())
        figures.plots["migration.svg"] = workers_plot(measured.migration);
    return figures;
}

/// What a program writes to its standard output, to its end.
std::string output_of(const std::vector<std::string>& command) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    if (!file) throw std::runtime_error("error: cannot make a temporary file");
    if (const int status = wait_for_child(start_child({command, {}, -1, fileno(file.get()), -1}));
        status != 0)
        throw std::runtime_error(fmt::format("error: {} ended with status {}", command[0], status));
    std::rewind(file.get());
    std::string text;
    std::array<char, 65536> part;
    while (const std::size_t size = std::fread(part.data(), 1, part.size(), file.get()))
        text.append(part.data(), size);
    return text;
}

/// Runs a benchmark that lies beside what it measures: a program in the folder of this one which prints its
/// figures, processor time by name, as Google Benchmark does.
Figures run_bench_program(const std::string& bench, const BenchOptions&) {
    const std::string name = "musicworld_" + bench + "_bench";
    const fs::path program = program_beside(name);
    if (!fs::exists(program))
        throw std::runtime_error(fmt::format(
            "error: cannot find {}; cmake --build BUILD --target {} builds it", program.string(), name));
    BenchReport report;
    try {
        const Json output = Json::parse(output_of({program.string(), "--benchmark_format=json"}));
        for (const Json& one : output.at("benchmarks"))
            report.results.push_back({one.at("name"), one.at("cpu_time"), one.at("time_unit")});
    } catch (const Json::exception& wrong) {
        throw std::runtime_error(
            fmt::format("error: a benchmark's output is not understood: {}", wrong.what()));
    }
    report.notes.push_back(name + ": processor time.");
    return {format_text(report), format_json(report)};
}

const std::vector<Bench> kBenches = {
    {"tracking", {"bench.json"}, run_bench_program},
    {"sim", {"bench.json"}, bench_the_simulation},
    {"hard", {"bench.json", "hard.csv", "hard.svg", "hard.html"}, bench_the_hard_scenes},
    {"workers", {"bench.json", "speed_up", "speed_up.csv", "bound.csv", "migration.svg"}, bench_the_workers},
    {"render", {"bench.json"}, run_bench_program},
    {"audio", {"bench.json"}, run_bench_program},
    {"tradeoff", {"tradeoff.json", "tradeoff.csv", "tradeoff.svg"}, bench_the_tradeoff}};

Figures run_bench(const Bench& bench, const BenchOptions& options, const std::string& out) {
    // Opened before the minutes of measuring, so that a place that cannot be written is known at once.
    std::optional<OutputFolder> folder;
    if (!out.empty()) folder.emplace(out, bench.products);
    Figures figures = bench.measure(bench.name, options);
    if (!folder) return figures;
    write_file(folder->path(bench.products.front()), figures.json);
    for (const auto& [name, table] : figures.tables) write_file(folder->path(name), table);
    for (const auto& [name, plot] : figures.plots) {
        fs::create_directories(folder->path(name).parent_path());
        write_file(folder->path(name), draw_svg({plot}, folder->scratch()).front());
    }
    for (const auto& [name, page] : figures.pages) {
        fs::create_directories(folder->scratch());
        write_file(folder->path(name), page(folder->scratch()));
    }
    folder->finish();
    return figures;
}

/// Appends the lists of one document to those of the other; of the rest the first's is kept.
void merge(Json& all, const Json& one) {
    for (const auto& [key, value] : one.items())
        if (!all.contains(key))
            all[key] = value;
        else if (value.is_array())
            all[key].insert(all[key].end(), value.begin(), value.end());
}

Figures bench_all(const BenchOptions& o) {
    Json json;
    Figures all;
    for (const Bench& bench : kBenches) {
        say(bench.name);
        const Figures one = run_bench(bench, o, o.out.empty() ? "" : (fs::path(o.out) / bench.name).string());
        all.text += fmt::format("== {}\n{}\n", bench.name, one.text);
        merge(json, Json::parse(one.json));
    }
    all.json = json.dump(2) + "\n";
    return all;
}

void add_bench_options(Command& program) {
    auto o = std::make_shared<BenchOptions>();
    o->workers.program = program_beside("musicworld").string();
    std::vector<std::string> names;
    for (const Bench& bench : kBenches) names.push_back(bench.name);
    names.emplace_back("all");
    program.required("NAME", o->name, as::choice(names), "What is measured: " + one_of(names));
    using Counts = std::vector<std::int64_t>;
    const auto counts = as::list_of(as::whole(1, 100000));
    program.option<Counts>(
        "--bodies", counts, "sim, workers: how many, in turn",
        [o](const Counts& bodies) {
            o->sim.bodies.assign(bodies.begin(), bodies.end());
            o->workers.bodies = o->sim.bodies;
        },
        "25,100,400,1600 of sim, 25,400 of workers");
    program.option<Counts>(
        "--workers", counts, "workers: how many, in turn",
        [o](const Counts& workers) { o->workers.workers.assign(workers.begin(), workers.end()); },
        "1,2,3,5,10");
    program.option("--steps", o->workers.steps, as::whole(1, 1000000), "workers: of each run");
    program.option("--bound", o->workers.bound, as::whole(1, 64, "steps"),
                   "workers: how far one may be ahead");
    program.option("--processors", o->workers.processors, as::processors(),
                   "workers: simulated[:latency=S,slowdown=X,cost=measured|modelled]");
    program.option<std::vector<std::string>>(
        "--only", as::list_of(as::choice(workers_bench_parts())), "workers: some parts",
        [o](const std::vector<std::string>& parts) {
            o->workers.only = {parts.begin(), parts.end()};
        },
        "all");
    std::vector<std::string> scenes;
    for (const HardScene& scene : hard_scenes()) scenes.push_back(scene.name);
    program.option("--scenes", o->hard.scenes, as::list_of(as::choice(scenes)), "hard: some scenes");
    program.option("--halvings", o->hard.halvings, as::whole(0, 10),
                   "hard: of the step, at most, for peers to be as near as we are");
    program.option("--rounds", o->sim.rounds, as::whole(0, 1000),
                   "sim: how often each; 0: five, three for 100, one for more");
    program.option<std::string>("--scene", as::text("SCENE"),
                                "sim: balls of a scene, e.g. benchmark25, instead of the piles",
                                [o](const std::string& name) { o->sim.scene = balls_of(name); });
    program.flag("--json", o->json, "Print one JSON document");
    program.option("--out", o->out, as::text("DIR"),
                   "Folder for bench.json and plots; of tradeoff for tradeoff.svg, .csv and .json; of all a "
                   "folder for each");
    program.runs([o] {
        const auto bench = std::ranges::find(kBenches, o->name, &Bench::name);
        const Figures figures = bench == kBenches.end() ? bench_all(*o) : run_bench(*bench, *o, o->out);
        fmt::print("{}", o->json ? figures.json : figures.text);
    });
}

}  // namespace
}  // namespace app

int main(int argc, char** argv) {
    CLI::App program("Measure speed beside peers, and speed against error", "musicworld bench");
    app::Command command(program);
    app::add_bench_options(command);
    return app::run_commands(program, argc, argv);
}
