#include "bench_command.h"

#include <falling_bodies.h>
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bad_input.h"
#include "bench_report.h"
#include "bench_sim.h"
#include "bench_tradeoff.h"
#include "comma_list.h"
#include "gnuplot.h"
#include "output_folder.h"
#include "scene.h"

namespace app {
namespace {

struct BenchArguments {
    std::string name, bodies = "25,100,400,1600", out, scene;
    int rounds = 0;
    bool json = false;
};

/// Benchmarks that lie beside what they measure, as programs of their own.
struct Separate {
    const char *name, *target;
};
constexpr std::array<Separate, 3> kSeparate = {{{"tracking", "musicworld_tracking_bench"},
                                                {"render", "musicworld_render_bench"},
                                                {"audio", "musicworld_live_bench"}}};

std::vector<int> parse_bodies(const std::string& list) {
    std::vector<int> counts;
    for (const std::string& part : split_at_commas(list)) {
        int count = 0;
        const auto [end, wrong] = std::from_chars(part.data(), part.data() + part.size(), count);
        if (wrong != std::errc() || end != part.data() + part.size() || count < 1 || count > 100000)
            throw BadInput(
                fmt::format("error: found --bodies {}, expected whole numbers from 1 to 100000 with "
                            "commas between them, e.g. 25,100",
                            list));
        counts.push_back(count);
    }
    return counts;
}

void say(const std::string& line) {
    fmt::print(stderr, "{}\n", line);
}

void bench_the_simulation(const BenchArguments& a) {
    SimBenchOptions options;
    options.bodies = parse_bodies(a.bodies);
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

/// True if NAME is a benchmark that is not part of this program; says so.
bool is_elsewhere(const std::string& name) {
    for (const Separate& other : kSeparate)
        if (name == other.name) {
            fmt::print(
                "bench {} is a program of its own: cmake --build build/release --target {}, then run it\n",
                other.name, other.target);
            return true;
        }
    if (name == "workers") fmt::print("bench workers: not there yet\n");
    return name == "workers";
}

void bench(const BenchArguments& a) {
    if (a.name == "all") {
        if (a.json || !a.out.empty())
            throw BadInput(
                "error: found bench all with --json or --out, expected one benchmark there: sim or tradeoff");
        for (const char* name : {"tracking", "render", "audio", "workers"}) (void)is_elsewhere(name);
    }
    if (is_elsewhere(a.name)) return;
    if (a.name != "tradeoff") bench_the_simulation(a);
    if (a.name != "sim") bench_the_tradeoff(a);
}

}  // namespace

void add_bench_command(CLI::App& program) {
    CLI::App* command =
        program.add_subcommand("bench", "Measure speed beside peers, and speed against error");
    auto a = std::make_shared<BenchArguments>();
    command
        ->add_option("NAME", a->name, "sim, tradeoff, all; tracking, render, audio are programs of their own")
        ->required()
        ->check(CLI::IsMember({"sim", "tradeoff", "tracking", "render", "audio", "workers", "all"}));
    command->add_option("--bodies", a->bodies, "sim: how many, in turn");
    command->add_option("--rounds", a->rounds, "sim: how often each; 0: five, three for 100, one for more")
        ->check(CLI::Range(0, 1000));
    command->add_option("--scene", a->scene, "sim: balls of a scene, e.g. benchmark25, instead of the piles");
    command->add_flag("--json", a->json, "Print one JSON document");
    command->add_option("--out", a->out,
                        "Folder for bench.json; of tradeoff for tradeoff.svg, .csv and .json");
    command->callback([a] { bench(*a); });
}

}  // namespace app
