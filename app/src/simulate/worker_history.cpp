#include "simulate/worker_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "report/plot_panel.h"

namespace app {
namespace {

constexpr std::size_t kMostPoints = 4000;
constexpr int kWidth = 900, kPanel = 260, kFrame = 56;

std::string lines(const std::vector<WorkerHistory::Point>& points, bool seconds) {
    std::string text;
    for (const WorkerHistory::Point& p : points)
        seconds ? fmt::format_to(std::back_inserter(text), "{} {:.6g}\n", p.step, 1e3 * p.seconds)
                : fmt::format_to(std::back_inserter(text), "{} {}\n", p.step, p.bodies);
    return text;
}

std::string panel(const WorkerHistory& history, bool seconds) {
    PlotPanel panel;
    for (const auto& [worker, points] : history.workers())
        panel.add(lines(points, seconds),
                  fmt::format("with {} lw 1.4 lc {} title 'worker {}'", seconds ? "lines" : "steps",
                              worker_colour(static_cast<std::size_t>(worker)), worker));
    return panel.text();
}

std::string margins(int top, int bottom, int height) {
    return fmt::format("set tmargin at screen {}\nset bmargin at screen {}\n",
                       1 - static_cast<double>(top) / height, 1 - static_cast<double>(bottom) / height);
}

}  // namespace

void WorkerHistory::add(const sim::WorkerStep& step) {
    if (step.step % every_ != 0) return;
    std::vector<Point>& points = workers_[step.worker];
    points.push_back({step.step, step.bodies, step.seconds, step.smoothed_s});
    if (points.size() < kMostPoints) return;
    every_ *= 2;
    for (auto& [worker, kept] : workers_)
        kept.erase(
            std::remove_if(kept.begin(), kept.end(), [&](const Point& p) { return p.step % every_ != 0; }),
            kept.end());
}

std::string worker_colour(std::size_t number) {
    constexpr std::array<const char*, 10> kColours = {"#2468b4", "#c07a12", "#2b9a48", "#6b46c1", "#e03131",
                                                      "#0f8a8a", "#b5179e", "#5d6874", "#8a5a2b", "#7c8fd6"};
    return fmt::format("rgb '{}'", kColours[number % kColours.size()]);
}

PlotScript workers_plot(const WorkerHistory& history) {
    constexpr int kHeight = 2 * kPanel + kFrame;
    std::string commands = plot_axes() +
                           "set key outside right top\nset multiplot\nset lmargin at screen "
                           "0.085\nset rmargin at screen 0.86\nset yrange [0:]\n";
    commands += margins(12, kPanel - 12, kHeight) + "set format x ''\nset ylabel 'bodies a worker'\n" +
                panel(history, false);
    commands += margins(kPanel + 12, 2 * kPanel - 6, kHeight) +
                "unset key\nset format x '%g'\nset xlabel 'step'\nset ylabel 'ms a step'\n" +
                panel(history, true);
    return {kWidth, kHeight, commands + "unset multiplot\n"};
}

}  // namespace app
