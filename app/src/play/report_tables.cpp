#include "play/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "play/play_plots.h"
#include "report/html.h"
#include "report/report_style.h"
#include "statistics/statistics.h"
#include "strikes/score_strikes.h"
#include "strikes/strike_score.h"

namespace app {
namespace {

std::string percent(int part, int whole) {
    return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "none";
}

struct InstrumentRow {
    int contacts = 0, released = 0, cancelled = 0, wrong = 0, missed = 0;
    std::vector<double> errors_ms;
};

std::vector<InstrumentRow> count_by_instrument(const PlayResult& result) {
    std::vector<InstrumentRow> rows(result.instruments.size());
    const std::vector<Mark> marks = strike_marks(result);
    for (std::size_t i = 0; i < marks.size(); ++i) {
        InstrumentRow& row = rows.at(result.strikes[i].instrument);
        row.cancelled += marks[i] == Mark::cancelled;
        row.released += marks[i] != Mark::cancelled;
        row.wrong += marks[i] == Mark::wrong;
    }
    for (const TrueContact& contact : result.contacts) {
        InstrumentRow& row = rows.at(contact.instrument);
        ++row.contacts;
        row.missed += contact.matched_id == 0;
    }
    for (const MatchedNote& note : matched_notes(result))
        rows.at(note.instrument).errors_ms.push_back(note.error_ms);
    return rows;
}

/// Rounded to tenths, without a negative zero.
double tenths(double value) {
    return std::round(value * 10) / 10 + 0.0;
}

/// Median of the absolute and of the signed errors, as two cells.
std::string error_cells(const std::vector<double>& errors_ms) {
    if (errors_ms.empty()) return "<td class=n>&ndash;</td><td class=n>&ndash;</td>";
    std::vector<double> sizes = errors_ms;
    for (double& size : sizes) size = std::abs(size);
    return fmt::format("<td class=n>{:.1f}</td><td class=n>{:+.1f}</td>", median(sizes),
                       tenths(median(errors_ms)));
}

}  // namespace

std::string report_heading(const PlayResult& r) {
    std::string text =
        fmt::format("<header><h1>{}</h1>\n<p>played on {} by MusicWorld</p>\n<dl class=facts>\n",
                    html(std::filesystem::path(r.trace).filename().string()), html(r.kit_name));
    text += report_fact("trace", r.trace);
    if (!r.trace_source.empty()) text += report_fact("recorded from", r.trace_source);
    text += report_fact("kit", r.kit);
    text += report_fact(
        "duration", fmt::format("{:.3f} s ({:.3f} s to {:.3f} s)", r.t_end_s - r.t0_s, r.t0_s, r.t_end_s));
    text += report_fact("pictures predicted by",
                        fmt::format("{}, {:.1f} ms ahead", r.picture_predictor, r.render_lead_s * 1e3));
    text += report_fact("sounds predicted by",
                        fmt::format("{}, up to {:.1f} ms ahead", r.sound_predictor, r.sound_lead_s * 1e3));
    text +=
        report_fact("sounds are fixed", fmt::format("{:.1f} ms before their onset; cancelling is {}",
                                                    r.release_margin_s * 1e3, r.cancelling ? "on" : "off"));
    text += report_fact("frames",
                        fmt::format("{} of {} x {}, {:g} a second", r.frames, r.width, r.height, r.fps));
    return text + "</dl></header>\n";
}

std::string report_figures(const PlayResult& r) {
    const StrikeScore& s = r.score;
    const bool matched = s.released > s.false_notes;
    const auto ms = [&](double value) {
        return matched ? fmt::format("{:.1f} ms", value) : std::string("none");
    };
    std::string text = "<section class=figures>\n";
    text += report_figure(fmt::format("{}", s.true_contacts), "true contacts", "contact");
    text += report_figure(fmt::format("{}", s.released), "released", "released");
    text += report_figure(fmt::format("{}", s.cancelled), "cancelled", "cancelled");
    text += report_figure(fmt::format("{}", s.moved), "moved", "axis");
    text += report_figure(fmt::format("{}", s.false_notes), "false", "wrong");
    text += report_figure(fmt::format("{}", s.missed), "missed", "missed");
    text += report_figure(ms(s.timing_median_ms), "median error", "axis");
    text += report_figure(ms(s.timing_p95_ms), "95 % error", "axis");
    text += "</section>\n";
    text += fmt::format(
        "<p class=note>Heard: {} of the true contacts. False: {} of the notes, {} after a stroke that turned "
        "back at "
        "least 25 ms before the release point, {} later. The error is |onset - true contact| of the notes "
        "that belong to "
        "a contact (same stick and instrument, within 30 ms).</p>\n",
        percent(s.true_contacts - s.missed, s.true_contacts), percent(s.false_notes, s.released),
        s.false_turned_early, s.false_turned_late);
    return text;
}

std::string report_instruments(const PlayResult& result) {
    const std::vector<InstrumentRow> rows = count_by_instrument(result);
    std::string text =
        "<div class=scroll><table><tr><th>instrument<th class=n>true<th class=n>released<th class=n>cancelled"
        "<th class=n>false<th class=n>missed<th class=n>median |ms|<th class=n>median ms</tr>\n";
    int silent = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const InstrumentRow& row = rows[i];
        if (row.contacts + row.released + row.cancelled == 0) {
            ++silent;
            continue;
        }
        fmt::format_to(
            std::back_inserter(text),
            "<tr><td>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}{}</tr>\n",
            html(result.instruments[i]), row.contacts, row.released, row.cancelled, row.wrong, row.missed,
            error_cells(row.errors_ms));
    }
    text += "</table></div>\n";
    if (silent > 0) text += fmt::format("<p class=note>{} more of the kit were not struck.</p>\n", silent);
    return text;
}

std::string report_provenance(const PlayResult& r) {
    std::string text =
        "<p class=note>Times and workers, which differ between runs, are in summary.json.</p>\n";
    text += "<h2>Inputs</h2>\n<table><tr><th>file<th>SHA-256</tr>\n";
    for (const InputFile& input : r.inputs)
        fmt::format_to(std::back_inserter(text), "<tr><td>{}<td><code>{}</code></tr>\n", html(input.file),
                       html(input.sha256));
    text += "</table>\n<h2>Versions</h2>\n<table>\n";
    for (const auto& [name, version] : r.versions)
        fmt::format_to(std::back_inserter(text), "<tr><td>{}<td>{}</tr>\n", html(name), html(version));
    fmt::format_to(std::back_inserter(text),
                   "<tr><td>fingerprint of this machine and build<td><code>{}</code></tr></table>\n",
                   html(r.fingerprint));
    return text;
}

}  // namespace app
