#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "bench/bench_hard.h"
#include "bench/bench_report.h"
#include "report/html.h"
#include "report/json_document.h"
#include "report/table.h"

namespace app {
namespace {

using HardJson = nlohmann::ordered_json;

std::string step_of(const HardRun& run) {
    return fmt::format("1/{:.0f}", 1 / run.dt_s);
}

Cell error_of(const HardRun& run) {
    return std::isfinite(run.figures.error) ? Cell(run.figures.error) : Cell();
}

/// Columns of a run: what it is and what it did.
Table run_columns() {
    return Table::of({"scene", "engine", "version", "settings", "step_s:.5f", "halvings:d", "through:d",
                      "quarantined:d", "thrown:d", "penetration:.2g", "penetration_at_end:.2g", "drift:.2g",
                      "joint_gap:.2g", "energy_gained:.2g", "error:.2g", "right", "ms_per_s:.3g"});
}

Cells cells_of(const HardRun& run) {
    const HardFigures& f = run.figures;
    return {run.scene,
            run.engine,
            run.version,
            run.settings,
            run.dt_s,
            run.halvings,
            f.through,
            f.quarantined,
            f.thrown,
            f.penetration,
            f.penetration_at_end,
            f.drift,
            f.joint_gap,
            f.energy_gained,
            error_of(run),
            f.right,
            run.ms_per_s};
}

Table runs_of(const HardBench& bench) {
    Table table = run_columns();
    for (const HardComparison& scene : bench.scenes)
        for (const HardEntrant& entrant : scene.entrants)
            for (const HardRun& run : entrant.runs) table.add(cells_of(run));
    return table;
}

/// Each entrant at the scene's step, and what it takes to be as near as we are.
Table entrants_of(const HardComparison& scene) {
    Table table =
        Table::of({"engine", "settings", "through:d", "quarantined:d", "thrown:d", "penetration:.2g:%",
                   "drift:.2g:%", "joint_gap:.2g:%", "energy_gained:.2g:%", "error:.2g:%", "right",
                   "ms_per_s:.3g", "equal_step", "equal_ms_per_s:.3g", "ratio:.3g"});
    const HardRun* ours = scene.best_of(scene.entrants.front());
    const auto percent = [](std::optional<double> share) {
        return share && std::isfinite(*share) ? std::optional(100 * *share) : std::nullopt;
    };
    for (const HardEntrant& entrant : scene.entrants) {
        const HardRun& run = entrant.runs.front();
        const HardFigures& f = run.figures;
        const HardRun* equal = scene.best_of(entrant);
        table.add({run.engine, run.settings, f.through, f.quarantined, f.thrown, percent(f.penetration),
                   percent(f.drift), percent(f.joint_gap), percent(f.energy_gained), percent(f.error),
                   f.right ? "yes" : "no", run.ms_per_s, equal ? Cell(step_of(*equal)) : Cell(),
                   equal ? Cell(equal->ms_per_s) : Cell(),
                   equal && ours ? Cell(ours->ms_per_s / equal->ms_per_s) : Cell()});
    }
    return table;
}

/// As every benchmark's results, and the errors. Ours is the run at equal error; at the scene's step if none is.
Table results_of(const HardBench& bench) {
    Table table =
        Table::of({"name", "value:.4g", "unit", "peer", "peer_version", "peer_value:.4g", "ratio:.3f",
                   "step_s:.5f", "error:.3g", "right", "peer_step_s:.5f", "peer_error:.3g"});
    for (const HardComparison& scene : bench.scenes) {
        const HardRun* equal = scene.best_of(scene.entrants.front());
        const HardRun& ours = equal ? *equal : scene.ours();
        const auto add = [&](const std::string& name, const Cell& peer, const HardRun* best) {
            Cells row = {name, ours.ms_per_s, "ms a simulated second", peer};
            row.push_back(best ? Cell(best->version) : Cell());
            row.push_back(best ? Cell(best->ms_per_s) : Cell());
            row.push_back(best && equal ? Cell(ours.ms_per_s / best->ms_per_s) : Cell());
            for (const Cell& cell : {Cell(ours.dt_s), error_of(ours), Cell(ours.figures.right)})
                row.push_back(cell);
            row.push_back(best ? Cell(best->dt_s) : Cell());
            row.push_back(best ? error_of(*best) : Cell());
            table.add(std::move(row));
        };
        add("hard_" + scene.scene.name, {}, nullptr);
        for (const std::string& peer : scene.peers()) {
            const HardRun* best = scene.best_of(peer);
            add(fmt::format("hard_{}_vs_{}", scene.scene.name, lower(peer)),
                best ? fmt::format("{}, {}, step {}", peer, best->settings, step_of(*best))
                     : peer + ", none at this error",
                best);
        }
    }
    return table;
}

const ReportColour& engine_colour(std::size_t number) {
    return colours::sticks[number % colours::sticks.size()];
}

/// Ours, then the peers of the first scene.
std::vector<std::string> engines_of(const HardBench& bench) {
    if (bench.scenes.empty()) return {};
    std::vector<std::string> names = bench.scenes.front().peers();
    names.insert(names.begin(), bench.scenes.front().ours().engine);
    return names;
}

/// Axes that need no data.
constexpr const char* kAnyX = "set xrange [0.01:100]\n";
constexpr const char* kAnyY = "set yrange [0.01:100]\n";

/// Error against processor time, a line for each entrant in its engine's colour.
PlotScript precision_plot(const HardComparison& scene, const std::vector<std::string>& engines) {
    PlotPanel panel;
    bool any = false;
    std::vector<PlotLine> legend;
    for (std::size_t e = 0; e < engines.size(); ++e) {
        legend.push_back({engines[e], engine_colour(e)});
        for (const HardEntrant& entrant : scene.entrants) {
            if (entrant.runs.front().engine != engines[e]) continue;
            std::string data;
            for (const HardRun& run : entrant.runs)
                if (std::isfinite(run.figures.error))
                    fmt::format_to(std::back_inserter(data), "{:.5g} {:.5g}\n", run.ms_per_s,
                                   100 * std::max(run.figures.error, kLeastError));
            any = any || !data.empty();
            panel.add(data,
                      "with linespoints lt 1 lw 1.4 pt 7 ps 0.4 lc " + gnuplot_colour(engine_colour(e)));
        }
    }
    return {430, 260,
            plot_axes() +
                "set logscale xy\nset format '%g'\nset xlabel 'processor time for a simulated second "
                "[ms]'\nset ylabel 'error [%]'\n" +
                (any ? std::string() : std::string(kAnyX) + kAnyY) + panel.text(),
            legend};
}

std::string json_of(const HardBench& bench) {
    const HardJson json = {{"machine", machine_json(machine_name())},
                           {"results", results_of(bench).json()},
                           {"runs", runs_of(bench).json()},
                           {"notes", bench.notes}};
    return json_document(json);
}

std::string text_of(const HardBench& bench) {
    std::string text;
    for (const HardComparison& scene : bench.scenes)
        text += fmt::format("{}, {:g} s, step {}\n{}\n", scene.scene.name, scene.seconds,
                            step_of(scene.ours()), entrants_of(scene).text());
    for (const std::string& note : bench.notes) text += note + '\n';
    return text;
}

PlotScript hard_plot(const HardBench& bench) {
    const std::vector<std::string> engines = engines_of(bench);
    std::string tics;
    PlotPanel panel;
    bool any = false;
    for (std::size_t e = 0; e < engines.size(); ++e) {
        std::string data;
        for (std::size_t s = 0; s < bench.scenes.size(); ++s) {
            const HardComparison& scene = bench.scenes[s];
            if (e == 0)
                tics += fmt::format("{}{} {}", s == 0 ? "" : ", ", gnuplot_string(scene.scene.name), s);
            if (const HardRun* run =
                    e == 0 ? scene.best_of(scene.entrants.front()) : scene.best_of(engines[e]))
                fmt::format_to(std::back_inserter(data), "{} {:.5g}\n", double(s) + 0.14 * (double(e) - 1),
                               run->ms_per_s);
        }
        any = any || !data.empty();
        panel.add(data, fmt::format("with points pt 7 ps 0.9 lc {} title {}",
                                    gnuplot_colour(engine_colour(e)), gnuplot_string(engines[e])));
    }
    return {900, 380,
            plot_axes() +
                fmt::format("set key outside right top\nset logscale y\nset format y '%g'\n"
                            "set xrange [-0.6:{}]\nset xtics rotate by -30 ({})\n"
                            "set ylabel 'processor time at equal error [ms/s]'\n",
                            double(bench.scenes.size()) - 0.4, tics) +
                (any ? "" : kAnyY) + panel.text()};
}

BenchPage page_of(const HardBench& bench) {
    constexpr const char* kTitle = "Hard scenes";
    const MachineName machine = machine_name();
    BenchPage page;
    std::string body =
        report_header(kTitle, "Ours beside Bullet and MuJoCo: what breaks, by how much, and at what cost",
                      {{"processor", machine.processor}, {"compiler", machine.compiler}}) +
        PlotGallery::symbols() + page.plots.element(hard_plot(bench), "Processor time at equal error");
    for (const HardComparison& scene : bench.scenes)
        body += fmt::format("<section>\n{}{}</section>\n",
                            page.plots.element(precision_plot(scene, engines_of(bench)), scene.scene.name),
                            entrants_of(scene).html());
    for (const std::string& note : bench.notes) body += fmt::format("<p>{}</p>\n", html(note));
    page.text = report_page(kTitle, body);
    return page;
}

}  // namespace

Figures figures_of(const HardBench& bench) {
    return {text_of(bench),
            json_of(bench),
            {{"hard.csv", runs_of(bench).csv()}},
            {{"hard.svg", hard_plot(bench)}},
            {{"hard.html", page_of(bench)}}};
}

}  // namespace app
