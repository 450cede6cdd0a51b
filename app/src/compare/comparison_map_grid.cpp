#include "compare/comparison_map_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "compare/comparison_map.h"
#include "report/html.h"
#include "statistics/statistics.h"
#include "strikes/score_strikes.h"

namespace app {
namespace {

using Sensor = std::tuple<double, double, double>;  // rate [Hz], jitter [ms], share lost

/// The best estimators of one lead by sensor and noise [mm].
std::map<Sensor, std::map<double, const MapCell*>> rows_of(const Comparison& comparison, double lead_s) {
    std::map<Sensor, std::map<double, const MapCell*>> rows;
    for (const MapCell* cell : best_cells(comparison.map))
        if (cell->result.lead_s == lead_s)
            rows[{cell->rate_hz, cell->jitter_ms, cell->drop_out}][cell->noise_mm] = cell;
    return rows;
}

double gain_percent(double ratio) {
    return 100 * (1 - ratio);
}

/// The gain in % of the RMS error and its interval.
std::string cell_of(const PairedResult& result) {
    const PairedDifference& d = result.by_recording;
    const std::string name = html(result.predictor), gain = fmt::format("{:.1f} %", gain_percent(d.ratio));
    if (std::isinf(d.ratio)) return "<td class=none>the baseline errs nothing";
    if (!d.has_interval()) return fmt::format("<td>{} {}", name, gain);
    const std::string range = fmt::format("({:.1f} to {:.1f})", gain_percent(d.high), gain_percent(d.low));
    if (d.gain()) return fmt::format("<td class=gain>{} <b>{}</b> {}", name, gain, range);
    return fmt::format("<td class=none>{} {}", d.loss() ? "loss" : "no measurable gain", range);
}

std::string grid(const Comparison& comparison, double lead_s) {
    const auto rows = rows_of(comparison, lead_s);
    if (rows.empty()) return {};
    std::string text = fmt::format("<p>{}</p>\n<div class=scroll><table class=grid><tr><th>sensor",
                                   html(map_sentence(comparison, lead_s)));
    for (const auto& [noise_mm, cell] : rows.begin()->second)
        text += fmt::format("<th>noise {:g} mm", noise_mm);
    text += "</tr>\n";
    for (const auto& [sensor, cells] : rows) {
        const auto& [rate_hz, jitter_ms, lost] = sensor;
        text += fmt::format("<tr><td>{:g} Hz{}{}", rate_hz,
                            jitter_ms > 0 ? fmt::format(", jitter {:g} ms", jitter_ms) : "",
                            lost > 0 ? fmt::format(", {:g} % lost", 100 * lost) : "");
        for (const auto& [noise_mm, cell] : cells) text += cell_of(cell->result);
        text += "</tr>\n";
    }
    return text + "</table></div>\n";
}

}  // namespace

std::string map_sentence(const Comparison& comparison, double lead_s) {
    std::size_t sensors = 0;
    std::vector<double> gains;
    std::map<std::string, int> winners;
    for (const auto& [sensor, cells] : rows_of(comparison, lead_s))
        for (const auto& [noise_mm, cell] : cells) {
            ++sensors;
            if (!cell->result.by_recording.gain()) continue;
            gains.push_back(gain_percent(cell->result.by_recording.ratio));
            ++winners[cell->result.predictor];
        }
    if (sensors == 0) return {};
    std::vector<std::pair<int, std::string>> by_count;
    for (const auto& [name, count] : winners) by_count.emplace_back(-count, name);
    std::sort(by_count.begin(), by_count.end());
    std::string who;
    for (const auto& [count, name] : by_count)
        who += fmt::format("{}{} {}", who.empty() ? "" : ", ", name, -count);
    std::string text = fmt::format(
        "{:.1f} ms ahead the best estimator gains measurably over the best baseline "
        "in {} of {} sensors",
        1e3 * lead_s, gains.size(), sensors);
    if (!gains.empty()) text += fmt::format(", {:.1f} % in the median of these ({})", median(gains), who);
    return text + ".";
}

std::string map_grids(const Comparison& comparison) {
    std::string text;
    for (const double lead_s : comparison.options.leads_s) text += grid(comparison, lead_s);
    return text;
}

}  // namespace app
