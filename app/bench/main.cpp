// musicworld_bench, which `musicworld bench` becomes: our speed beside peers', and what accuracy costs.
#include <falling_bodies.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/bench_hard.h"
#include "bench/bench_report.h"
#include "bench/bench_sim.h"
#include "bench/bench_tradeoff.h"
#include "bench/bench_workers.h"
#include "command_line.h"
#include "commands/bench_options.h"
#include "commands/command.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "process/child_process.h"
#include "process/standard_streams.h"
#include "report/json_document.h"
#include "report/plot.h"
#include "scene/scene.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

using Show = std::function<void(const std::string& text)>;

struct Bench {
    std::string name;
    std::string length;                      ///< of all of it, on two cores
    std::vector<std::string_view> products;  ///< of its folder; the first is the JSON document
    /// Shows tables as soon as they are there; the text of its figures is what is left to show.
    Figures (*measure)(const std::string& name, const BenchOptions& options, const Show& show);
};

void say(const std::string& line) {
    tell(line);
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

Figures bench_the_simulation(const std::string&, const BenchOptions& options, const Show&) {
    return figures_of(bench_sim(options.sim, say));
}

Figures bench_the_tradeoff(const std::string&, const BenchOptions&, const Show&) {
    return figures_of(measure_tradeoff(all_tradeoff_settings(), kConverged, kFiner, say));
}

Figures bench_the_hard_scenes(const std::string&, const BenchOptions& options, const Show& show) {
    HardBench all;
    const std::vector<std::string>& chosen = options.hard.scenes;
    for (const std::string& scene : kHardSceneNames) {
        if (!chosen.empty() && std::ranges::find(chosen, scene) == chosen.end()) continue;
        HardBenchOptions one = options.hard;
        one.scenes = {scene};
        HardBench found = bench_hard(one, say);
        all.notes = std::exchange(found.notes, {});  // the same for all scenes
        show(figures_of(found).text);
        std::ranges::move(found.scenes, std::back_inserter(all.scenes));
    }
    Figures figures = figures_of(all);
    figures.text = fmt::format("{}\n", fmt::join(all.notes, "\n"));
    return figures;
}

Figures bench_the_workers(const std::string&, const BenchOptions& options, const Show& show) {
    WorkersBench all;
    for (const std::string& part : kWorkersBenchParts) {
        WorkersBenchOptions one = options.workers;
        if (!one.only.empty() && !one.only.contains(part)) continue;
        one.only = {part};
        WorkersBench found = bench_workers(one, say);
        show(figures_of(found).text + '\n');
        std::ranges::move(found.report.results, std::back_inserter(all.report.results));
        for (const std::string& note : found.report.notes)
            if (std::ranges::find(all.report.notes, note) == all.report.notes.end())
                all.report.notes.push_back(note);
        std::ranges::move(found.speed_ups, std::back_inserter(all.speed_ups));
        std::ranges::move(found.bounds, std::back_inserter(all.bounds));
        if (part == "migration") all.migration = std::move(found.migration);
    }
    Figures figures = figures_of(all);
    figures.text.clear();
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
Figures run_bench_program(const std::string& bench, const BenchOptions&, const Show&) {
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
    return figures_of(report);
}

const std::vector<Bench> kBenches = {
    {"tracking", "a minute", {"bench.json"}, run_bench_program},
    {"sim", "ten minutes", {"bench.json"}, bench_the_simulation},
    {"hard",
     "a quarter of an hour",
     {"bench.json", "hard.csv", "hard.svg", "hard.html"},
     bench_the_hard_scenes},
    {"workers",
     "ten minutes",
     {"bench.json", "speed_up", "speed_up.csv", "bound.csv", "migration.svg"},
     bench_the_workers},
    {"render", "ten seconds", {"bench.json"}, run_bench_program},
    {"audio", "ten seconds", {"bench.json"}, run_bench_program},
    {"tradeoff", "two minutes", {"tradeoff.json", "tradeoff.csv", "tradeoff.svg"}, bench_the_tradeoff}};

Figures run_bench(const Bench& bench, const BenchOptions& options, const std::string& out, const Show& show) {
    say(fmt::format("bench {}: about {} on two cores, less where options leave parts out", bench.name,
                    bench.length));
    // Opened before the minutes of measuring, so that a place that cannot be written is known at once.
    std::optional<OutputFolder> folder;
    if (!out.empty()) folder.emplace(out, bench.products);
    Figures figures = bench.measure(bench.name, options, show);
    if (!folder) return figures;
    write_file(folder->path(bench.products.front()), figures.json);
    for (const auto& [name, table] : figures.tables) write_file(folder->path(name), table);
    Plotter plotter(folder->scratch());
    for (const auto& [name, plot] : figures.plots) {
        fs::create_directories(folder->path(name).parent_path());
        if (const std::string drawn = plotter.draw({plot}).front(); !drawn.empty())
            write_file(folder->path(name), drawn);
    }
    for (const auto& [name, page] : figures.pages)
        write_file(folder->path(name), page.plots.drawn(page.text, plotter));
    folder->finish();
    if (!plotter.failure().empty()) throw_if_any({plotter.failure()}, out);
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

Figures bench_all(const BenchOptions& o, const Show& show) {
    Json json;
    for (const Bench& bench : kBenches) {
        show(fmt::format("== {}\n", bench.name));
        const Figures one =
            run_bench(bench, o, o.out.empty() ? "" : (fs::path(o.out) / bench.name).string(), show);
        show(one.text + '\n');
        merge(json, Json::parse(one.json));
    }
    return {"", json_document(json)};
}

void run_benches(BenchOptions& o) {
    o.workers.program = program_beside("musicworld").string();
    if (!o.scene.empty()) o.sim.scene = balls_of(o.scene);
    const auto bench = std::ranges::find(kBenches, o.name, &Bench::name);
    const Show show = [&o](const std::string& text) {
        if (o.json) return;
        fmt::print("{}", text);
        std::fflush(stdout);
    };
    const Figures figures = bench == kBenches.end() ? bench_all(o, show) : run_bench(*bench, o, o.out, show);
    fmt::print("{}", o.json ? figures.json : figures.text);
}

}  // namespace
}  // namespace app

int main(int argc, char** argv) {
    CLI::App program("Measure speed beside peers, and speed against error", "musicworld bench");
    app::Command command(program);
    app::BenchOptions options;
    app::add_bench_options(command, options);
    command.runs([&] { app::run_benches(options); });
    return app::run_commands(program, argc, argv);
}
