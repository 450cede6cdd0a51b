#include "bench/bench_command.h"

#include <falling_bodies.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "bench/bench_sim.h"
#include "bench/bench_tradeoff.h"
#include "bench/bench_workers.h"
#include "bench/google_bench.h"
#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/output_folder.h"
#include "process/child_process.h"
#include "report/gnuplot.h"
#include "scene/scene.h"
#include "simulate/worker_options.h"

namespace app {
namespace {

struct BenchArguments {
    std::string name, bodies, out, scene, workers = "1,2,3,5,10", only, processors = "simulated";
    int rounds = 0, steps = 500, bound = 4;
    bool json = false;
};

/// A benchmark's figures as text and as one JSON document.
struct Figures {
    std::string text, json;
};

Figures figures_of(const auto& measured) {
    return {format_text(measured), format_json(measured)};
}

/// "25,100" of an option that means so many of something.
std::vector<int> parse_counts(const std::string& option, const std::string& list) {
    constexpr int kMost = 100000;
    std::vector<int> counts;
    for (const std::string& part : split_at_commas(list)) {
        int count = 0;
        const auto [end, wrong] = std::from_chars(part.data(), part.data() + part.size(), count);
        if (wrong != std::errc() || end != part.data() + part.size() || count < 1 || count > kMost)
            throw BadInput(
                fmt::format("error: found {} {}, expected whole numbers from 1 to {} with "
                            "commas between them, e.g. 25,100",
                            option, list, kMost));
        counts.push_back(count);
    }
    return counts;
}

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

/// Opened before the minutes of measuring, so that a place that cannot be written is known at once.
std::unique_ptr<OutputFolder> open_folder(const std::string& out,
                                          std::span<const std::string_view> products) {
    return out.empty() ? nullptr : std::make_unique<OutputFolder>(out, products);
}

/// Writes a report that has no other products.
Figures write_report(const std::unique_ptr<OutputFolder>& folder, const BenchReport& report) {
    if (folder) {
        write_file(folder->path("bench.json"), format_json(report));
        folder->finish();
    }
    return figures_of(report);
}

constexpr std::array<std::string_view, 1> kReportAlone = {"bench.json"};

Figures bench_the_simulation(const BenchArguments& a, const std::string& out) {
    SimBenchOptions options;
    if (!a.bodies.empty()) options.bodies = parse_counts("--bodies", a.bodies);
    options.rounds = a.rounds;
    if (!a.scene.empty()) options.scene = balls_of(a.scene);
    const std::unique_ptr<OutputFolder> folder = open_folder(out, kReportAlone);
    return write_report(folder, bench_sim(options, say));
}

Figures bench_the_tradeoff(const std::string& out) {
    static constexpr std::array<std::string_view, 3> kProducts = {"tradeoff.json", "tradeoff.csv",
                                                                  "tradeoff.svg"};
    const std::unique_ptr<OutputFolder> folder = open_folder(out, kProducts);
    const Tradeoff measured =
        measure_tradeoff(all_tradeoff_settings(), converged_setting(), finer_setting(), say);
    if (folder) {
        std::filesystem::create_directories(folder->scratch());
        write_file(folder->path("tradeoff.json"), format_json(measured));
        write_file(folder->path("tradeoff.csv"), format_csv(measured));
        write_file(folder->path("tradeoff.svg"),
                   draw_svg({{900, 560, plot_commands(measured)}}, folder->scratch()).front());
        folder->finish();
    }
    return figures_of(measured);
}

WorkersBenchOptions workers_options_of(const BenchArguments& a) {
    WorkersBenchOptions options;
    if (!a.bodies.empty()) options.bodies = parse_counts("--bodies", a.bodies);
    options.workers = parse_counts("--workers", a.workers);
    options.steps = a.steps, options.bound = a.bound;
    options.processors = parse_processors(a.processors);
    options.program = program_beside("musicworld").string();
    const std::vector<std::string>& parts = workers_bench_parts();
    for (const std::string& part : a.only.empty() ? parts : split_at_commas(a.only)) {
        if (std::find(parts.begin(), parts.end(), part) == parts.end())
            throw BadInput(
                fmt::format("error: found --only {}, expected some of {}", a.only, fmt::join(parts, ",")));
        options.only.insert(part);
    }
    return options;
}

void write_workers(OutputFolder& out, const WorkersBench& measured) {
    std::filesystem::create_directories(out.scratch());
    write_file(out.path("bench.json"), format_json(measured.report));
    const auto draw = [&](const std::string& name, const PlotScript& plot) {
        write_file(out.path(name), draw_svg({plot}, out.scratch()).front());
    };
    if (!measured.speed_ups.empty()) {
        write_file(out.path("speed_up.csv"), speed_up_csv(measured.speed_ups));
        std::filesystem::create_directories(out.path("speed_up"));
        for (const SpeedUp& s : measured.speed_ups)
            draw(fmt::format("speed_up/bodies{}.svg", s.bodies), speed_up_plot(s));
    }
    if (!measured.bounds.empty()) write_file(out.path("bound.csv"), bound_csv(measured.bounds));
    if (!measured.migration.workers().empty()) draw("migration.svg", workers_plot(measured.migration));
    out.finish();
}

Figures bench_the_workers(const BenchArguments& a, const std::string& out) {
    static constexpr std::array<std::string_view, 5> kProducts = {"bench.json", "speed_up", "speed_up.csv",
                                                                  "bound.csv", "migration.svg"};
    const WorkersBenchOptions options = workers_options_of(a);
    const std::unique_ptr<OutputFolder> folder = open_folder(out, kProducts);
    const WorkersBench measured = bench_workers(options, say);
    if (folder) write_workers(*folder, measured);
    return {format_text(measured), format_json(measured.report)};
}

constexpr std::array<const char*, 6> kNames = {"tracking", "sim", "workers", "render", "audio", "tradeoff"};

Figures bench_one(const std::string& name, const BenchArguments& a, const std::string& out) {
    if (name == "sim") return bench_the_simulation(a, out);
    if (name == "workers") return bench_the_workers(a, out);
    if (name == "tradeoff") return bench_the_tradeoff(out);
    const std::unique_ptr<OutputFolder> folder = open_folder(out, kReportAlone);
    return write_report(folder, run_bench_program("musicworld_" + name + "_bench"));
}

/// Appends the lists of one document to those of the other; of the rest the first's is kept.
void merge(nlohmann::ordered_json& all, const nlohmann::ordered_json& one) {
    for (const auto& [key, value] : one.items())
        if (!all.contains(key))
            all[key] = value;
        else if (value.is_array())
            all[key].insert(all[key].end(), value.begin(), value.end());
}

Figures bench_all(const BenchArguments& a) {
    nlohmann::ordered_json json;
    Figures all;
    for (const std::string name : kNames) {
        say(name);
        const std::string out = a.out.empty() ? "" : (std::filesystem::path(a.out) / name).string();
        const Figures one = bench_one(name, a, out);
        all.text += fmt::format("== {}\n{}\n", name, one.text);
        merge(json, nlohmann::ordered_json::parse(one.json));
    }
    all.json = json.dump(2) + "\n";
    return all;
}

}  // namespace

void add_bench_options(CLI::App& program) {
    auto a = std::make_shared<BenchArguments>();
    program
        .add_option("NAME", a->name,
                    "tracking, sim, workers, render, audio, tradeoff: what is measured; all: each in turn")
        ->required()
        ->check(CLI::IsMember({"tracking", "sim", "workers", "render", "audio", "tradeoff", "all"}));
    program.add_option("--bodies", a->bodies,
                       "sim, workers: how many, in turn; default: 25,100,400,1600; 25,400");
    program.add_option("--workers", a->workers, "workers: how many, in turn")->capture_default_str();
    program.add_option("--steps", a->steps, "workers: of each run")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    program.add_option("--bound", a->bound, "workers: steps ahead")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    program.add_option("--processors", a->processors,
                       "workers: simulated[:latency=S,slowdown=X,cost=measured|modelled]");
    program.add_option("--only", a->only,
                       "workers: some of speedup,stragglers,bound,migration,processes,throughput");
    program.add_option("--rounds", a->rounds, "sim: how often each; 0: five, three for 100, one for more")
        ->check(CLI::Range(0, 1000));
    program.add_option("--scene", a->scene, "sim: balls of a scene, e.g. benchmark25, instead of the piles");
    program.add_flag("--json", a->json, "Print one JSON document");
    program.add_option(
        "--out", a->out,
        "Folder for bench.json and plots; of tradeoff for tradeoff.svg, .csv and .json; of all a "
        "folder for each");
    program.callback([a] {
        const Figures figures = a->name == "all" ? bench_all(*a) : bench_one(a->name, *a, a->out);
        fmt::print("{}", a->json ? figures.json : figures.text);
    });
}

}  // namespace app
