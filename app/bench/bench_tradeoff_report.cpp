#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "bench/bench_report.h"
#include "bench/bench_tradeoff.h"
#include "report/plot.h"
#include "report/table.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

int modes_of(const TradeoffSetting& setting) {
    if (setting.fidelity == sim::Fidelity::rigid) return 0;
    return setting.fidelity == sim::Fidelity::linear ? 6 : setting.modes;
}

Json point_json(const TradeoffPoint& point) {
    const TradeoffSetting& s = point.setting;
    return {{"name", name_of(s)},     {"value", point.ms_per_s},  {"unit", "ms a simulated second"},
            {"peer", nullptr},        {"peer_version", nullptr},  {"ratio", nullptr},
            {"error", point.error},   {"modes", modes_of(s)},     {"step_s", 1.0 / s.steps_per_s},
            {"elements", s.elements}, {"triangles", s.triangles}, {"pareto", point.pareto}};
}

std::vector<TradeoffPoint> front_of(const Tradeoff& tradeoff) {
    std::vector<TradeoffPoint> front;
    for (const TradeoffPoint& point : tradeoff.points)
        if (point.pareto) front.push_back(point);
    std::sort(front.begin(), front.end(),
              [](const TradeoffPoint& a, const TradeoffPoint& b) { return a.ms_per_s < b.ms_per_s; });
    return front;
}

Table table_of(const std::vector<TradeoffPoint>& points) {
    Table table = Table::of({"name", "modes:d", "step_s:.5f", "elements:d", "triangles:d", "ms_per_s:.3f",
                             "error:.3g", "pareto"});
    for (const TradeoffPoint& p : points)
        table.add({name_of(p.setting), modes_of(p.setting), 1.0 / p.setting.steps_per_s, p.setting.elements,
                   p.setting.triangles, p.ms_per_s, p.error, p.pareto});
    return table;
}

/// For a terminal.
std::string lines_of(const std::vector<TradeoffPoint>& points) {
    return table_of(points).part({"name", "ms_per_s", "error"}).text();
}

std::string marks(const std::vector<TradeoffPoint>& points) {
    std::string text;
    for (const TradeoffPoint& p : points)
        fmt::format_to(std::back_inserter(text), "{:.5g} {:.5g}\n", p.ms_per_s, 100 * p.error);
    return text;
}

std::string colour(const char* rgb) {
    return fmt::format("lc rgb '{}'", rgb);
}

}  // namespace

std::string format_csv(const Tradeoff& tradeoff) {
    return table_of(tradeoff.points).csv();
}

std::string format_json(const Tradeoff& tradeoff) {
    Json json;
    json["machine"] = machine_json(machine_name());
    json["results"] = Json::array();
    for (const TradeoffPoint& point : tradeoff.points) json["results"].push_back(point_json(point));
    json["automatic"] = point_json(tradeoff.automatic);
    json["automatic"]["requested_error"] = tradeoff.requested_error;
    json["converged"] = {{"name", name_of(tradeoff.converged)},
                         {"finer", name_of(tradeoff.finer)},
                         {"error", tradeoff.converged_error}};
    return json.dump(2) + "\n";
}

std::string format_text(const Tradeoff& tradeoff) {
    std::string text = fmt::format("Pareto front\n{}\nautomatic ({} % asked of the displacement) takes\n{}",
                                   lines_of(front_of(tradeoff)), 100 * tradeoff.requested_error,
                                   lines_of({tradeoff.automatic}));
    text += fmt::format(
        "\n{} points. Time: processor time for a simulated second of two touching bodies. Error: rms "
        "distance of their\n"
        "surface points to {}, of the largest extent;\nthat run is within {:.3f} % of {}.\n",
        tradeoff.points.size(), name_of(tradeoff.converged), 100 * tradeoff.converged_error,
        name_of(tradeoff.finer));
    return text;
}

std::string plot_commands(const Tradeoff& tradeoff) {
    PlotPanel panel;
    const auto of = [&](auto belongs) {
        std::vector<TradeoffPoint> some;
        std::copy_if(tradeoff.points.begin(), tradeoff.points.end(), std::back_inserter(some),
                     [&](const TradeoffPoint& p) { return belongs(p.setting); });
        return marks(some);
    };
    const auto dots = [](const char* rgb, const char* title) {
        return fmt::format("with points pt 7 ps 0.45 {} title '{}'", colour(rgb), title);
    };
    panel.add(of([](const TradeoffSetting& s) { return modes_of(s) == 0; }), dots("#8c8c8c", "rigid"));
    panel.add(of([](const TradeoffSetting& s) { return s.fidelity == sim::Fidelity::linear; }),
              dots("#c77c11", "linear"));
    panel.add(
        of([](const TradeoffSetting& s) { return s.fidelity == sim::Fidelity::modal && s.modes <= 11; }),
        dots("#2c7fb8", "5, 11 modes"));
    panel.add(of([](const TradeoffSetting& s) {
                  return s.fidelity == sim::Fidelity::modal && s.modes > 11 && s.modes <= 23;
              }),
              dots("#41ab5d", "14, 23 modes"));
    panel.add(of([](const TradeoffSetting& s) { return s.fidelity == sim::Fidelity::modal && s.modes > 23; }),
              dots("#88419d", "45, 75 modes"));
    panel.add(marks(front_of(tradeoff)),
              fmt::format("with linespoints pt 6 ps 0.8 lw 1.5 {} title 'Pareto front'", colour("#d7301f")));
    panel.add(marks({tradeoff.automatic}),
              fmt::format("with points pt 4 ps 1.6 lw 2 {} title 'automatic'", colour("#000000")));
    const auto [fastest, slowest] = std::minmax_element(
        tradeoff.points.begin(), tradeoff.points.end(),
        [](const TradeoffPoint& a, const TradeoffPoint& b) { return a.ms_per_s < b.ms_per_s; });
    if (fastest != tradeoff.points.end())
        panel.add(fmt::format("{0:.5g} {2:.5g}\n{1:.5g} {2:.5g}\n", fastest->ms_per_s, slowest->ms_per_s,
                              100 * tradeoff.converged_error),
                  fmt::format("with lines dt 2 {} title 'converged to'", colour("#8c8c8c")));
    return plot_axes() +
           "set key outside right top\nset logscale xy\nset xlabel 'processor time for a simulated second "
           "[ms]'\n"
           "set ylabel 'rms error [% of the largest extent]'\n" +
           panel.text();
}

}  // namespace app
