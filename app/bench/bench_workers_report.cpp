#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "bench/bench_workers.h"
#include "report/plot.h"
#include "report/table.h"

namespace app {
namespace {

constexpr int kWidth = 960, kHeight = 380;

/// Lines "workers value".
template <typename Value>
std::string points(const SpeedUp& speed_up, const Value& value) {
    std::string text;
    for (const SpeedUp::Row& row : speed_up.rows)
        fmt::format_to(std::back_inserter(text), "{} {:.6g}\n", row.workers, value(row));
    return text;
}

/// `of` takes elapsed seconds to what the panel shows.
template <typename Shown>
std::string panel(const SpeedUp& s, const Shown& of) {
    using Row = SpeedUp::Row;
    const auto marks = [](const char* colour, const char* title, int dash) {
        return fmt::format("with linespoints pt 7 ps 0.5 lw 1.6 dt {} lc rgb '{}' title '{}'", dash, colour,
                           title);
    };
    PlotPanel panel;
    panel.add(points(s, [&](const Row& r) { return of(s.alone_s / r.workers); }),
              marks("#8c8c8c", "ideal", 1));
    panel.add(points(s, [&](const Row& r) { return of(r.ceiling_s); }), marks("#2b9a48", "ceiling", 3));
    panel.add(points(s, [&](const Row& r) { return of(r.async_s); }), marks("#2468b4", "asynchronous", 1));
    panel.add(points(s, [&](const Row& r) { return of(r.lockstep_s); }), marks("#e03131", "lockstep", 2));
    return panel.text();
}

Table table_of(const SpeedUp& s) {
    Table table;
    for (const SpeedUp::Row& r : s.rows)
        table.add_figures({{"bodies:d", s.bodies},
                           {"workers:d", r.workers},
                           {"ideal_s:.3g", s.alone_s / r.workers},
                           {"ceiling_s:.3g", r.ceiling_s},
                           {"async_s:.3g", r.async_s},
                           {"lockstep_s:.3g", r.lockstep_s},
                           {"bytes_per_body_step:.0f", r.bytes},
                           {"async_speed_up:.2f", s.alone_s / r.async_s, false},
                           {"ceiling_speed_up:.2f", s.alone_s / r.ceiling_s, false},
                           {"lockstep_speed_up:.2f", s.alone_s / r.lockstep_s, false},
                           {"async_of_ceiling:.2f", r.ceiling_s / r.async_s, false}});
    return table;
}

Table table_of(const std::vector<BoundRow>& rows) {
    Table table = Table::of({"bound:d", "elapsed_s:.3g", "elapsed_unsteady_s:.3g", "momentum_drift:.2g",
                             "apart_m:.2g", "height:.4f", "ghost_age:d"});
    for (const BoundRow& r : rows)
        table.add(
            {r.bound, r.elapsed_s, r.elapsed_unsteady_s, r.momentum_drift, r.apart_m, r.height, r.ghost_age});
    return table;
}

}  // namespace

PlotScript speed_up_plot(const SpeedUp& s) {
    std::string commands =
        plot_axes() + "set multiplot layout 1,2\nset key right top\nset xlabel 'workers'\nset xrange [0:]\n";
    commands += fmt::format("set yrange [0:]\nset ylabel 'elapsed [s], {} bodies'\n", s.bodies) +
                panel(s, [](double elapsed) { return elapsed; });
    commands += "set key left top\nset ylabel 'speed-up [times]'\n" +
                panel(s, [&](double elapsed) { return s.alone_s / elapsed; });
    return {kWidth, kHeight, commands + "unset multiplot\n"};
}

std::string speed_up_csv(const std::vector<SpeedUp>& speed_ups) {
    Table all;
    for (const SpeedUp& s : speed_ups) {
        Table table = table_of(s);
        all.columns = std::move(table.columns);
        std::ranges::move(table.rows, std::back_inserter(all.rows));
    }
    return all.csv();
}

std::string bound_csv(const std::vector<BoundRow>& rows) {
    return table_of(rows).csv();
}

std::string format_text(const WorkersBench& bench) {
    std::string text;
    for (const SpeedUp& s : bench.speed_ups)
        text += fmt::format("{} bodies: {:.3g} s on one processor\n{}\n", s.bodies, s.alone_s,
                            table_of(s)
                                .part({"workers", "async_speed_up", "ceiling_speed_up", "lockstep_speed_up",
                                       "async_of_ceiling", "bytes_per_body_step"})
                                .text());
    text += table_of(bench.bounds).text();
    return (text.empty() ? text : text + '\n') + format_text(bench.report);
}

}  // namespace app
