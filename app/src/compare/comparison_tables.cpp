#include "compare/comparison_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "compare/comparison_map.h"
#include "compare/comparison_map_grid.h"
#include "compare/comparison_pairs.h"
#include "play/tables.h"
#include "report/table.h"

namespace app {
namespace {

std::string number(double value, bool any) {
    return any ? fmt::format("{}", value) : "";
}

std::string hit_columns(const std::optional<HitScore>& hits, double advance_s) {
    if (!hits) return ",,,,,,,,,,";
    return fmt::format("{},{},{},{},{},{},{},{},{},{},{}", hits->true_contacts, hits->predicted,
                       hits->matched, hits->precision(), hits->recall(), hits->f1(),
                       number(hits->median_ms(), hits->matched > 0),
                       number(hits->p95_ms(), hits->matched > 0), hits->false_per_min(),
                       hits->false_per_min_without_cancel(), 1e3 * advance_s);
}

std::string calibration_columns(const std::optional<Calibration>& calibration) {
    if (!calibration) return ",,";
    return fmt::format("{},{},{}", calibration->inside_50, calibration->inside_95,
                       calibration->negative_log_likelihood);
}

std::size_t widest(const Comparison& comparison) {
    std::size_t width = 9;
    for (const auto& [name, description] : comparison.predictors) width = std::max(width, name.size());
    return width;
}

std::string cell(double value, bool any, int decimals) {
    return any ? fmt::format("{:.{}f}", value, decimals) : "-";
}

void add_summary(std::string& text, const ComparisonSummary& s, std::size_t width) {
    const ErrorScore& e = s.error;
    fmt::format_to(std::back_inserter(text), "{:<{}} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7}", s.predictor, width,
                   cell(e.rms_mm, e.count > 0, 2), cell(e.p95_mm, e.count > 0, 2),
                   cell(e.free_rms_mm, e.free_count > 0, 2), cell(e.tip_rms_mm, e.rotation_count > 0, 2),
                   cell(e.rotation_rms_deg, e.rotation_count > 0, 2),
                   s.external ? "extern" : cell(s.ns_per_sample, s.ns_per_sample > 0, 0));
    if (s.calibration)
        fmt::format_to(std::back_inserter(text), " {:>5.1f} {:>5.1f} {:>6.2f}",
                       100 * s.calibration->inside_50, 100 * s.calibration->inside_95,
                       s.calibration->negative_log_likelihood);
    else
        fmt::format_to(std::back_inserter(text), " {:>5} {:>5} {:>6}", "-", "-", "-");
    if (s.hits)
        fmt::format_to(std::back_inserter(text), " {:>6} {:>6.3f} {:>6} {:>6} {:>7.2f} {:>7.2f}",
                       s.hits->true_contacts, s.hits->f1(), cell(s.hits->median_ms(), s.hits->matched > 0, 1),
                       cell(s.hits->p95_ms(), s.hits->matched > 0, 1), s.hits->false_per_min(),
                       s.hits->false_per_min_without_cancel());
    text += '\n';
}

std::string heading(std::size_t width, bool hits) {
    std::string text =
        fmt::format("{:<{}} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>5} {:>5} {:>6}", "predictor", width,
                    "rms mm", "p95 mm", "free mm", "tip mm", "rot deg", "ns", "in50%", "in95%", "nll");
    if (hits)
        text += fmt::format(" {:>6} {:>6} {:>6} {:>6} {:>7} {:>7}", "true", "F1", "med ms", "p95 ms",
                            "false/m", "uncanc.");
    return text + "\n";
}

void add_paired(std::string& text, const Comparison& comparison, double lead_s, std::size_t width) {
    for (const PairedResult& paired : comparison.paired) {
        if (paired.lead_s != lead_s) continue;
        fmt::format_to(std::back_inserter(text), "  {:<{}} against {}: {}", paired.predictor, width,
                       paired.baseline, verdict(paired.by_recording));
        if (paired.by_person)
            fmt::format_to(std::back_inserter(text), "; by person {}", verdict(*paired.by_person));
        text += '\n';
    }
}

void add_advances(std::string& text, const Comparison& comparison, double lead_s) {
    for (const ComparisonSummary& s : comparison.summaries) {
        if (s.lead_s != lead_s || !s.advance_s) continue;
        const auto [low_s, high_s] = *s.advance_s;
        const std::string range = low_s == high_s ? fmt::format("{:g}", 1e3 * low_s)
                                                  : fmt::format("{:g} to {:g}", 1e3 * low_s, 1e3 * high_s);
        fmt::format_to(std::back_inserter(text),
                       "  {}: its contacts are brought forward (negative: put back) by {} ms, learned on "
                       "tuning recordings\n",
                       s.predictor, range);
    }
}

void add_map(std::string& text, const Comparison& comparison) {
    text += fmt::format(
        "\nWhere filters pay, each sensor and lead: the best estimator against the best baseline, tuned "
        "alike\n"
        "{:>5} {:>8} {:>9} {:>6} {:>7}  {:<22} {:>8}  {:<22} {:>8}  ratio\n",
        "Hz", "noise mm", "jitter ms", "lost", "lead ms", "estimator", "rms mm", "baseline", "rms mm");
    for (const MapCell* cell : best_cells(comparison.map)) {
        const PairedResult& r = cell->result;
        fmt::format_to(std::back_inserter(text),
                       "{:>5} {:>8} {:>9} {:>5.0f}% {:>7.1f}  {:<22} {:>8.2f}  {:<22} {:>8.2f}  {}\n",
                       cell->rate_hz, cell->noise_mm, cell->jitter_ms, 100 * cell->drop_out, 1e3 * r.lead_s,
                       r.predictor, r.rms_mm, r.baseline, r.baseline_rms_mm, verdict(r.by_recording));
    }
    for (const double lead_s : comparison.options.leads_s) text += map_sentence(comparison, lead_s) + "\n";
}

}  // namespace

std::string format_comparison_csv(const Comparison& comparison) {
    std::string text =
        "trace,person,stick,predictor,used,lead_s,rate_hz,noise_mm,rms_mm,p95_mm,free_rms_mm,"
        "unflagged_rms_mm,rotation_rms_deg,tip_rms_mm,predictions,ns_per_sample,inside_50,inside_95,"
        "negative_log_likelihood,true,predicted,matched,precision,recall,f1,median_ms,p95_ms,false_per_min,"
        "false_per_min_without_cancel,advance_ms\n";
    for (const ComparisonRow& row : comparison.rows) {
        const ErrorScore& e = row.error;
        fmt::format_to(
            std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
            csv_field(row.trace), csv_field(row.person), csv_field(row.stick), csv_field(row.predictor),
            csv_field(row.used), row.lead_s, row.rate_hz, row.noise_mm, number(e.rms_mm, e.count > 0),
            number(e.p95_mm, e.count > 0), number(e.free_rms_mm, e.free_count > 0),
            number(e.unflagged_rms_mm, e.unflagged_count > 0),
            number(e.rotation_rms_deg, e.rotation_count > 0), number(e.tip_rms_mm, e.rotation_count > 0),
            e.count, number(row.ns_per_sample, row.ns_per_sample > 0), calibration_columns(row.calibration),
            hit_columns(row.hits, row.advance_s.value_or(0)));
    }
    return text;
}

std::string format_comparison_text(const Comparison& comparison) {
    const std::size_t width = widest(comparison);
    const bool hits = std::any_of(comparison.summaries.begin(), comparison.summaries.end(),
                                  [](const ComparisonSummary& s) { return s.hits.has_value(); });
    const std::size_t recordings = comparison.options.traces.size(), persons = comparison.persons.size();
    std::string text =
        fmt::format("{} recording{} of {} person{}; {}\n", recordings, recordings == 1 ? "" : "s", persons,
                    persons == 1 ? "" : "s", comparison.tuned_on);
    for (const double lead_s : comparison.options.leads_s) {
        text += fmt::format("\n{:.1f} ms ahead\n{}", 1e3 * lead_s, heading(width, hits));
        for (const ComparisonSummary& summary : comparison.summaries)
            if (summary.lead_s == lead_s) add_summary(text, summary, width);
        add_paired(text, comparison, lead_s, width);
        add_advances(text, comparison, lead_s);
    }
    if (!comparison.map.empty()) add_map(text, comparison);
    text += '\n';
    for (const std::string& sentence : winners(comparison)) text += sentence + "\n";
    return text + selection_caution(comparison) + "\n";
}

}  // namespace app
