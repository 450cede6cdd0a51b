#include "bench/bench_command.h"

#include <falling_bodies.h>
#include <fmt/format.h>

#include <array>
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
#include "commands/worker_options.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "process/child_process.h"
#include "report/gnuplot.h"
#include "scene/scene.h"

namespace app {
namespace {

struct BenchOptions {
    std::string name, out;
    SimBenchOptions sim;
    WorkersBenchOptions workers;
    bool json = false;
};

/// A benchmark's figures as text and as one JSON document.
struct Figures {
    std::string text, json;
};

Figures figures_of(const auto& measured) {
    return {format_text(measured), format_json(measured)};
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

Figures bench_the_simulation(const SimBenchOptions& options, const std::string& out) {
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

Figures bench_the_workers(const WorkersBenchOptions& options, const std::string& out) {
    static constexpr std::array<std::string_view, 5> kProducts = {"bench.json", "speed_up", "speed_up.csv",
                                                                  "bound.csv", "migration.svg"};
    const std::unique_ptr<OutputFolder> folder = open_folder(out, kProducts);
    const WorkersBench measured = bench_workers(options, say);
    if (folder) write_workers(*folder, measured);
    return {format_text(measured), format_json(measured.report)};
}

const std::vector<std::string> kNames = {"tracking", "sim", "workers", "render", "audio", "tradeoff"};

Figures bench_one(const std::string& name, const BenchOptions& o, const std::string& out) {
    if (name == "sim") return bench_the_simulation(o.sim, out);
    if (name == "workers") return bench_the_workers(o.workers, out);
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

Figures bench_all(const BenchOptions& o) {
    nlohmann::ordered_json json;
    Figures all;
    for (const std::string& name : kNames) {
        say(name);
        const std::string out = o.out.empty() ? "" : (std::filesystem::path(o.out) / name).string();
        const Figures one = bench_one(name, o, out);
        all.text += fmt::format("== {}\n{}\n", name, one.text);
        merge(json, nlohmann::ordered_json::parse(one.json));
    }
    all.json = json.dump(2) + "\n";
    return all;
}

}  // namespace

void add_bench_options(Command& program) {
    auto o = std::make_shared<BenchOptions>();
    o->workers.program = program_beside("musicworld").string();
    std::vector<std::string> names = kNames;
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
        const Figures figures = o->name == "all" ? bench_all(*o) : bench_one(o->name, *o, o->out);
        fmt::print("{}", o->json ? figures.json : figures.text);
    });
}

}  // namespace app
