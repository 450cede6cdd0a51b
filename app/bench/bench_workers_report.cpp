#include <fmt/format.h>

#include <iterator>

#include "bench/bench_workers.h"
#include "report/plot_panel.h"

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
    std::string text = "bodies,workers,ideal_s,ceiling_s,async_s,lockstep_s,bytes_per_body_step\n";
    for (const SpeedUp& s : speed_ups)
        for (const SpeedUp::Row& r : s.rows)
            fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}\n", s.bodies, r.workers,
                           s.alone_s / r.workers, r.ceiling_s, r.async_s, r.lockstep_s, r.bytes);
    return text;
}

std::string bound_csv(const std::vector<BoundRow>& rows) {
    std::string text = "bound,elapsed_s,elapsed_unsteady_s,momentum_drift,apart_m,height,ghost_age\n";
    for (const BoundRow& r : rows)
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}\n", r.bound, r.elapsed_s,
                       r.elapsed_unsteady_s, r.momentum_drift, r.apart_m, r.height, r.ghost_age);
    return text;
}

std::string format_text(const WorkersBench& bench) {
    std::string text;
    const auto out = std::back_inserter(text);
    for (const SpeedUp& s : bench.speed_ups) {
        fmt::format_to(
            out, "{} bodies: speed-up over one processor, {:.3g} s\n{:>8} {:>8} {:>8} {:>8} {:>9} {:>12}\n",
            s.bodies, s.alone_s, "workers", "async", "ceiling", "lockstep", "of ceil.", "bytes/body");
        for (const SpeedUp::Row& r : s.rows)
            fmt::format_to(out, "{:>8} {:>8.2f} {:>8.2f} {:>8.2f} {:>9.2f} {:>12.0f}\n", r.workers,
                           s.alone_s / r.async_s, s.alone_s / r.ceiling_s, s.alone_s / r.lockstep_s,
                           r.ceiling_s / r.async_s, r.bytes);
        text += '\n';
    }
    if (!bench.bounds.empty())
        fmt::format_to(out, "{:>8} {:>10} {:>14} {:>10} {:>14} {:>10} {:>10}\n", "bound", "elapsed s",
                       "unsteady s", "drift", "apart m, 1 s", "height", "ghost age");
    for (const BoundRow& r : bench.bounds)
        fmt::format_to(out, "{:>8} {:>10.3g} {:>14.3g} {:>10.2g} {:>14.2g} {:>10.4f} {:>10}\n", r.bound,
                       r.elapsed_s, r.elapsed_unsteady_s, r.momentum_drift, r.apart_m, r.height, r.ghost_age);
    return (text.empty() ? text : text + '\n') + format_text(bench.report);
}

}  // namespace app
