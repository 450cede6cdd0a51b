#include "compare/comparison_report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "compare/comparison_map.h"
#include "report/html.h"
#include "statistics/statistics.h"

namespace app {
namespace {

/// A table of a report: text columns first, then numbers.
class HtmlTable {
public:
    HtmlTable(const std::vector<std::string>& names, std::size_t text_columns) : text_columns_(text_columns) {
        text_ = "<div class=scroll><table class=wide><tr>";
        for (std::size_t i = 0; i < names.size(); ++i)
            text_ += fmt::format("<th{}>{}", i < text_columns ? "" : " class=n", html(names[i]));
        text_ += "</tr>\n";
    }
    void add(const std::vector<std::string>& cells) {
        text_ += "<tr>";
        for (std::size_t i = 0; i < cells.size(); ++i)
            text_ += fmt::format("<td{}>{}", class_of(i, cells[i]), html(cells[i]));
        text_ += "</tr>\n";
        ++rows_;
    }
    /// Long texts may wrap.
    [[nodiscard]] const char* class_of(std::size_t column, const std::string& cell) const {
        constexpr std::size_t kLong = 60;
        if (column >= text_columns_) return " class=n";
        return cell.size() > kLong ? " class=text" : "";
    }
    /// Empty without rows.
    [[nodiscard]] std::string text() const { return rows_ > 0 ? text_ + "</table></div>\n" : ""; }

private:
    std::string text_;
    std::size_t text_columns_, rows_ = 0;
};

std::string number(double value, int decimals, bool any = true) {
    return any ? fmt::format("{:.{}f}", value, decimals) : "\xe2\x80\x93";
}

/// The advances learned, over all sticks; a dash where none is.
std::string advance_text(const ComparisonSummary& s) {
    if (!s.advance_s) return "\xe2\x80\x93";
    const double low_ms = 1e3 * s.advance_s->first, high_ms = 1e3 * s.advance_s->second;
    return low_ms == high_ms ? fmt::format("{:g}", low_ms) : fmt::format("{:g} to {:g}", low_ms, high_ms);
}

std::string milliseconds(double lead_s) {
    return fmt::format("{:.1f}", 1e3 * lead_s);
}

}  // namespace

std::string error_table(const Comparison& comparison, double lead_s) {
    HtmlTable table({"predictor", "RMS mm", "95 % mm", "free of impacts mm", "unflagged mm", "tip mm",
                     "rotation deg", "ns a sample"},
                    1);
    for (const ComparisonSummary& s : comparison.summaries) {
        if (s.lead_s != lead_s) continue;
        const ErrorScore& e = s.error;
        const bool turned = e.rotation_count > 0;
        table.add({s.predictor, number(e.rms_mm, 2), number(e.p95_mm, 2),
                   number(e.free_rms_mm, 2, e.free_count > 0),
                   number(e.unflagged_rms_mm, 2, e.unflagged_count > 0), number(e.tip_rms_mm, 2, turned),
                   number(e.rotation_rms_deg, 2, turned),
                   s.external ? "external" : number(s.ns_per_sample, 0, s.ns_per_sample > 0)});
    }
    return table.text();
}

std::string strike_table(const Comparison& comparison, double lead_s) {
    HtmlTable table({"predictor", "true", "predicted", "matched", "precision", "recall", "F1", "median ms",
                     "95 % ms", "false a minute", "not cancelling", "advance ms"},
                    1);
    for (const ComparisonSummary& s : comparison.summaries) {
        if (s.lead_s != lead_s || !s.hits) continue;
        const HitScore& h = *s.hits;
        table.add({s.predictor, fmt::format("{}", h.true_contacts), fmt::format("{}", h.predicted),
                   fmt::format("{}", h.matched), number(h.precision(), 3), number(h.recall(), 3),
                   number(h.f1(), 3), number(h.median_ms(), 1, h.matched > 0),
                   number(h.p95_ms(), 1, h.matched > 0), number(h.false_per_min(), 2),
                   number(h.false_per_min_without_cancel(), 2), advance_text(s)});
    }
    return table.text();
}

std::string calibration_table(const Comparison& comparison, double lead_s) {
    HtmlTable table({"predictor", "predictions", "inside the 50 % region", "inside the 95 % region",
                     "negative log likelihood, nats"},
                    1);
    for (const ComparisonSummary& s : comparison.summaries)
        if (s.lead_s == lead_s && s.calibration)
            table.add({s.predictor, fmt::format("{}", s.calibration->count),
                       number(100 * s.calibration->inside_50, 1) + " %",
                       number(100 * s.calibration->inside_95, 1) + " %",
                       number(s.calibration->negative_log_likelihood, 2)});
    return table.text();
}

std::string paired_table(const Comparison& comparison, double lead_s) {
    const bool persons = comparison.persons.size() >= 2;
    std::vector<std::string> names = {"estimator", "best baseline", "ratio by recording"};
    if (persons) names.emplace_back("ratio by person");
    for (const char* name : {"RMS mm", "baseline mm", "difference mm", "95 % interval mm"})
        names.emplace_back(name);
    HtmlTable table(names, persons ? 4 : 3);
    for (const PairedResult& p : comparison.paired) {
        if (p.lead_s != lead_s) continue;
        const PairedDifference& d = p.by_recording;
        std::vector<std::string> cells = {p.predictor, p.baseline, verdict(d)};
        if (persons) cells.push_back(p.by_person ? verdict(*p.by_person) : "one person");
        cells.push_back(number(p.rms_mm, 2));
        cells.push_back(number(p.baseline_rms_mm, 2));
        cells.push_back(fmt::format("{:+.2f}", d.difference_mm));
        cells.push_back(d.has_interval()
                            ? fmt::format("{:+.2f} to {:+.2f}", d.difference_low_mm, d.difference_high_mm)
                            : "none");
        table.add(cells);
    }
    return table.text();
}

std::string map_table(const Comparison& comparison) {
    HtmlTable table({"best estimator", "best baseline", "difference", "Hz", "noise mm", "jitter ms", "lost %",
                     "lead ms", "RMS mm", "baseline mm"},
                    3);
    for (const MapCell* cell : best_cells(comparison.map)) {
        const PairedResult& r = cell->result;
        table.add({r.predictor, r.baseline, verdict(r.by_recording), fmt::format("{:g}", cell->rate_hz),
                   fmt::format("{:g}", cell->noise_mm), fmt::format("{:g}", cell->jitter_ms),
                   fmt::format("{:g}", 100 * cell->drop_out), milliseconds(r.lead_s), number(r.rms_mm, 2),
                   number(r.baseline_rms_mm, 2)});
    }
    return table.text();
}

std::string predictor_table(const Comparison& comparison) {
    HtmlTable table({"predictor", "what it is", "what ran, and on how many sticks and leads"}, 3);
    for (const auto& [name, description] : comparison.predictors) {
        std::map<std::string, int> used;
        for (const ComparisonRow& row : comparison.rows)
            if (row.predictor == name) ++used[row.used];
        std::string ran;
        for (const auto& [specification, count] : used)
            ran += fmt::format("{}{} ({})", ran.empty() ? "" : "; ", specification, count);
        table.add({name, description, ran});
    }
    return table.text();
}

}  // namespace app
