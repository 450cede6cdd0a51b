#include "commands/bench_command.h"

#include <falling_bodies.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/bench_report.h"
#include "bench/bench_sim.h"
#include "bench/bench_tradeoff.h"
#include "bench/bench_workers.h"
#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/output_folder.h"
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

/// Benchmarks that lie beside what they measure, as programs of their own.
struct Separate {
    const char *name, *target;
};
constexpr std::array<Separate, 3> kSeparate = {{{"tracking", "musicworld_tracking_bench"},
                                                {"render", "musicworld_render_bench"},
                                                {"audio", "musicworld_live_bench"}}};

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

void bench_the_simulation(const BenchArguments& a) {
    SimBenchOptions options;
    if (!a.bodies.empty()) options.bodies = parse_counts("--bodies", a.bodies);
    options.rounds = a.rounds;
    if (!a.scene.empty()) {
        Scene scene = read_scene(find_scene(a.scene));
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
        options.scene = {scene.name, scene.world};
    }
    // The folder first: a place that cannot be written is known before the minutes of measuring.
    static constexpr std::array<std::string_view, 1> kProducts = {"bench.json"};
    std::optional<OutputFolder> out;
    if (!a.out.empty()) out.emplace(a.out, kProducts);
    const BenchReport measured = bench_sim(options, say);
    if (out) {
        write_file(out->path("bench.json"), format_json(measured));
        out->finish();
    }
    fmt::print("{}", a.json ? format_json(measured) : format_text(measured));
}

void bench_the_tradeoff(const BenchArguments& a) {
    static constexpr std::array<std::string_view, 3> kProducts = {"tradeoff.json", "tradeoff.csv",
                                                                  "tradeoff.svg"};
    std::optional<OutputFolder> out;
    if (!a.out.empty()) out.emplace(a.out, kProducts);
    const Tradeoff measured =
        measure_tradeoff(all_tradeoff_settings(), converged_setting(), finer_setting(), say);
    if (out) {
        std::filesystem::create_directories(out->scratch());
        write_file(out->path("tradeoff.json"), format_json(measured));
        write_file(out->path("tradeoff.csv"), format_csv(measured));
        write_file(out->path("tradeoff.svg"),
                   draw_svg({{900, 560, plot_commands(measured)}}, out->scratch()).front());
        out->finish();
    }
    fmt::print("{}", a.json ? format_json(measured) : format_text(measured));
}

WorkersBenchOptions workers_options_of(const BenchArguments& a) {
    WorkersBenchOptions options;
    if (!a.bodies.empty()) options.bodies = parse_counts("--bodies", a.bodies);
    options.workers = parse_counts("--workers", a.workers);
    options.steps = a.steps, options.bound = a.bound;
    options.processors = parse_processors(a.processors);
    options.program = std::filesystem::read_symlink("/proc/self/exe").string();
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

void bench_the_workers(const BenchArguments& a) {
    static constexpr std::array<std::string_view, 5> kProducts = {"bench.json", "speed_up", "speed_up.csv",
                                                                  "bound.csv", "migration.svg"};
    const WorkersBenchOptions options = workers_options_of(a);
    std::optional<OutputFolder> out;
    if (!a.out.empty()) out.emplace(a.out, kProducts);
    const WorkersBench measured = bench_workers(options, say);
    if (out) write_workers(*out, measured);
    fmt::print("{}", a.json ? format_json(measured.report) : format_text(measured));
}

/// True if NAME is a benchmark that is not part of this program; says so.
bool is_elsewhere(const std::string& name) {
    for (const Separate& other : kSeparate)
        if (name == other.name) {
            fmt::print(
                "bench {} is a program of its own: cmake --build build/release --target {}, then run it\n",
                other.name, other.target);
            return true;
        }
    return false;
}

void bench(const BenchArguments& a) {
    if (a.name == "all") {
        if (a.json || !a.out.empty())
            throw BadInput(
                "error: found bench all with --json or --out, expected one benchmark there: sim, workers or "
                "tradeoff");
        for (const Separate& other : kSeparate) (void)is_elsewhere(other.name);
    }
    if (is_elsewhere(a.name)) return;
    const auto wanted = [&](const char* name) { return a.name == name || a.name == "all"; };
    if (wanted("sim")) bench_the_simulation(a);
    if (wanted("workers")) bench_the_workers(a);
    if (wanted("tradeoff")) bench_the_tradeoff(a);
}

}  // namespace

void add_bench_command(CLI::App& program) {
    CLI::App* command =
        program.add_subcommand("bench", "Measure speed beside peers, and speed against error");
    auto a = std::make_shared<BenchArguments>();
    command
        ->add_option("NAME", a->name,
                     "sim, workers, tradeoff, all; tracking, render, audio are programs of their own")
        ->required()
        ->check(CLI::IsMember({"sim", "tradeoff", "tracking", "render", "audio", "workers", "all"}));
    command->add_option("--bodies", a->bodies,
                        "sim, workers: how many, in turn; default: 25,100,400,1600; 25,400");
    command->add_option("--workers", a->workers, "workers: how many, in turn")->capture_default_str();
    command->add_option("--steps", a->steps, "workers: of each run")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    command->add_option("--bound", a->bound, "workers: steps ahead")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command->add_option("--processors", a->processors,
                        "workers: simulated[:latency=S,slowdown=X,cost=measured|modelled]");
    command->add_option("--only", a->only,
                        "workers: some of speedup,stragglers,bound,migration,processes,throughput");
    command->add_option("--rounds", a->rounds, "sim: how often each; 0: five, three for 100, one for more")
        ->check(CLI::Range(0, 1000));
    command->add_option("--scene", a->scene, "sim: balls of a scene, e.g. benchmark25, instead of the piles");
    command->add_flag("--json", a->json, "Print one JSON document");
    command->add_option("--out", a->out,
                        "Folder for bench.json and plots; of tradeoff for tradeoff.svg, .csv and .json");
    command->callback([a] { bench(*a); });
}

}  // namespace app
