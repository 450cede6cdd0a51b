#include "play/play_report.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "play/play_plots.h"
#include "report/html.h"
#include "report/report_style.h"
#include "report/table.h"
#include "statistics/statistics.h"
#include "strikes/score_strikes.h"

namespace app {
namespace fs = std::filesystem;
namespace {

std::string base64_of_file(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (!in.is_open() || in.bad() || bytes.empty())
        throw std::runtime_error(
            fmt::format("{}: error: found no readable frame, expected a PNG for the report", file.string()));
    std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // the encoder ends with a zero
    const int length =
        EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                        reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
    text.resize(static_cast<std::size_t>(length));
    return text;
}

/// "12 ms after snare (right)" for the released note nearest to a time, if one is within 0.1 s.
std::string nearest_note(const PlayResult& result, double shown_s) {
    const Strike* nearest = nullptr;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released &&
            (nearest == nullptr || std::abs(strike.onset_s - shown_s) < std::abs(nearest->onset_s - shown_s)))
            nearest = &strike;
    if (nearest == nullptr || std::abs(nearest->onset_s - shown_s) > 0.1) return {};
    const double after_ms = (shown_s - nearest->onset_s) * 1e3;
    return fmt::format("{:.0f} ms {} {} ({})", std::abs(after_ms), after_ms < 0 ? "before" : "after",
                       result.instruments.at(nearest->instrument), result.sticks.at(nearest->stick));
}

/// Frames are named by their number: frame k is shown at t0 + k / fps.
std::string frame_caption(const PlayResult& result, const fs::path& file) {
    std::string number = file.stem().string();
    if (number.empty() || number.size() > 12 || number.find_first_not_of("0123456789") != std::string::npos)
        return number;
    const double shown_s = result.t0_s + static_cast<double>(std::stoll(number)) / result.fps;
    const std::string note = nearest_note(result, shown_s);
    return fmt::format("{:.3f} s{}{}", shown_s, note.empty() ? "" : ": ", note);
}

std::string frames_section(const PlayResult& result) {
    if (result.report_frames.empty()) return {};
    std::string text = "<h2>Frames</h2>\n<div class=frames>\n";
    for (const fs::path& file : result.report_frames) {
        const std::string caption = html(frame_caption(result, file));
        fmt::format_to(
            std::back_inserter(text),
            "<figure><img width={} height={} alt=\"frame shown at {}\" src=\"data:image/png;base64,{}\">"
            "<figcaption>{}</figcaption></figure>\n",
            result.width, result.height, caption, base64_of_file(file), caption);
    }
    return text + "</div>\n";
}

std::string legend_entry(std::string_view shape, std::string_view name) {
    return fmt::format("<li><svg viewBox=\"0 0 22 12\" aria-hidden=\"true\">{}</svg>{}</li>\n", shape,
                       html(name));
}

std::string legend(const PlayResult& result) {
    std::string text = "<ul class=legend>\n";
    for (std::size_t i = 0; i < result.tracks.size(); ++i)
        text += legend_entry(fmt::format("<path d=\"M1,6h20\" stroke=\"var(--{})\" stroke-width=\"2.5\"/>",
                                         stick_colour(i).name),
                             "tip of " + result.tracks[i].stick);
    text += legend_entry(
        R"svg(<circle cx="11" cy="6" r="4.2" fill="none" stroke="var(--contact)" stroke-width="1.5"/>)svg",
        "true contact");
    text +=
        legend_entry(R"svg(<circle cx="11" cy="6" r="3.4" fill="var(--released)"/>)svg", "note at its onset");
    text += legend_entry(R"svg(<path d="M11,11l-5,-9h10z" fill="var(--wrong)"/>)svg", "false note");
    text += legend_entry(
        R"svg(<path d="M7,2h8v8h-8z" fill="none" stroke="var(--missed)" stroke-width="1.5"/>)svg",
        "missed contact");
    text +=
        legend_entry(R"svg(<path d="M7,2l8,8M15,2l-8,8" stroke="var(--cancelled)" stroke-width="1.5"/>)svg",
                     "cancelled note");
    return text + "</ul>\n";
}

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

std::string heading(const PlayResult& r) {
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
                        fmt::format("{} of {} x {}, {:g} per second", r.frames, r.width, r.height, r.fps));
    return text + "</dl></header>\n";
}

std::string figures(const PlayResult& r) {
    const StrikeScore& s = r.score;
    const bool matched = s.released > s.false_notes;
    const auto ms = [&](double value) {
        return matched ? fmt::format("{:.1f} ms", value) : std::string("none");
    };
    const auto count = [](int value) { return fmt::format("{}", value); };
    const std::tuple<std::string, const char*, const char*> cards[] = {
        {count(s.true_contacts), "true contacts", "contact"},
        {count(s.released), "released", "released"},
        {count(s.cancelled), "cancelled", "cancelled"},
        {count(s.moved), "moved", "axis"},
        {count(s.false_notes), "false", "wrong"},
        {count(s.missed), "missed", "missed"},
        {ms(s.timing_median_ms), "median error", "axis"},
        {ms(s.timing_p95_ms), "95 % error", "axis"}};
    std::string text = "<section class=figures>\n";
    for (const auto& [value, name, tone] : cards) text += report_figure(value, name, tone);
    text += "</section>\n";
    return text +
           fmt::format(
               "<p class=note>Heard: {} of the true contacts. False: {} of the notes, {} after a stroke that "
               "turned back at least 25 ms before the release point, {} later. The error is |onset - true "
               "contact| of the notes that belong to a contact (same stick and instrument, within 30 "
               "ms).</p>\n",
               percent(s.true_contacts - s.missed, s.true_contacts), percent(s.false_notes, s.released),
               s.false_turned_early, s.false_turned_late);
}

/// A row for each instrument that was struck or meant to be.
std::string instruments_section(const PlayResult& result) {
    const std::vector<InstrumentRow> rows = count_by_instrument(result);
    Table table = Table::of({"instrument", "true:d", "released:d", "cancelled:d", "false:d", "missed:d",
                             "median |ms|:.1f", "median ms:+.1f"});
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const InstrumentRow& row = rows[i];
        if (row.contacts + row.released + row.cancelled == 0) continue;
        std::vector<double> sizes_ms = row.errors_ms;
        for (double& size : sizes_ms) size = std::abs(size);
        table.add({result.instruments[i], row.contacts, row.released, row.cancelled, row.wrong, row.missed,
                   median(sizes_ms), tenths(median(row.errors_ms))});
    }
    std::string text = "<h2>By instrument</h2>\n" + table.html();
    if (const std::size_t silent = rows.size() - table.rows.size(); silent > 0)
        text += fmt::format("<p class=note>{} more of the kit were not struck.</p>\n", silent);
    return text;
}

/// Inputs and versions.
std::string provenance(const PlayResult& r) {
    Table inputs = Table::of({"file", "SHA-256"}), versions = Table::of({"part", "version"});
    for (const InputFile& input : r.inputs) inputs.add({input.file, input.sha256});
    for (const auto& [name, version] : r.versions) versions.add({name, version});
    versions.add({"fingerprint of this machine and build", r.fingerprint});
    return "<p class=note>Times and workers, which differ between runs, are in summary.json.</p>\n"
           "<h2>Inputs</h2>\n" +
           inputs.html() + "<h2>Versions</h2>\n" + versions.html();
}

/// The plots as elements of the page; `sound` and `overview` are empty where there is nothing to show.
struct DrawnPlots {
    std::vector<std::string> rows;
    std::string timing, instruments, leads, sound, overview, symbols;
};

DrawnPlots draw_plots(const PlayResult& result, const Timeline& timeline, const fs::path& scratch) {
    DrawnPlots plots;
    plots.rows.resize(timeline.starts_s.size());
    std::vector<PlotScript> scripts = timeline_plots(result, timeline);
    std::vector<std::pair<std::string*, std::string>> places;  // of each script: where it goes, what it shows
    for (std::size_t row = 0; row < plots.rows.size(); ++row)
        places.emplace_back(&plots.rows[row], fmt::format("timeline from {:g} s on", timeline.starts_s[row]));
    const auto add = [&](std::string& place, PlotScript script, const char* label) {
        scripts.push_back(std::move(script));
        places.emplace_back(&place, label);
    };
    add(plots.timing, timing_plot(result), "histogram of onset minus true contact");
    add(plots.instruments, timing_by_instrument_plot(result), "onset minus true contact by instrument");
    add(plots.leads, lead_plot(result), "first prediction and decision of each note");
    if (!result.audio.empty()) add(plots.sound, sound_plot(result), "envelope of the sound");
    if (!timeline.whole)
        add(plots.overview, overview_plot(result, timeline), "notes heard, false and missed over time");
    const std::vector<std::string> drawn = draw_svg(scripts, scratch);
    for (std::size_t i = 0; i < drawn.size(); ++i) *places[i].first = inline_svg(drawn[i], places[i].second);
    plots.symbols = svg_symbols(drawn.front());
    return plots;
}

std::string timeline_section(const PlayResult& result, const Timeline& timeline, const DrawnPlots& plots) {
    std::string text = "<h2>Timeline</h2>\n";
    if (!timeline.whole)
        text += fmt::format(
            "<p class=note>The whole recording: notes heard (green), false (red) and missed (purple) in "
            "each stretch. Enlarged below are the {} rows of {:g} s with the most false and missed ones, "
            "marked under the axis.</p>\n<div class=plot>\n{}</div>\n",
            plots.rows.size(), timeline.row_s, plots.overview);
    text += fmt::format(
        "<p class=note>Height of the tips as recorded over the trace's clock, {:g} s per row. A note stands "
        "at its onset, at the point where it was predicted to strike.{}</p>\n{}<div class=plot>\n",
        timeline.row_s, result.audio.empty() ? "" : " Under it the sound; vertical lines are onsets.",
        legend(result));
    for (const std::string& row : plots.rows) text += row;
    return text + "</div>\n";
}

std::string sound_section(const PlayResult& result, const std::string& plot) {
    float peak = 0;
    for (const float sample : result.audio) peak = std::max(peak, std::abs(sample));
    const std::string level = peak > 0 ? fmt::format("Peak {:.1f} dBFS", 20 * std::log10(peak)) : "Silence";
    return fmt::format(
        "<h2>Sound</h2>\n<p class=note>The whole file, both channels together: lowest and highest sample "
        "of each column; ticks below are onsets. {}, {} samples clipped.</p>\n<div class=plot>\n{}</div>\n",
        level, result.clipped_samples, plot);
}

std::string plot_sections(const PlayResult& result, const fs::path& scratch) {
    const Timeline timeline = timeline_of(result);
    const DrawnPlots plots = draw_plots(result, timeline, scratch);
    std::string text = plots.symbols + timeline_section(result, timeline, plots);
    text +=
        "<h2>Timing</h2>\n<p class=note>How far each note lies from the contact that it belongs to.</p>\n";
    text += fmt::format("<div class=pair><div class=plot>\n{}</div><div class=plot>\n{}</div></div>\n",
                        plots.timing, plots.instruments);
    text += instruments_section(result);
    text += fmt::format(
        "<h2>When notes were decided</h2>\n<p class=note>From its first prediction (ring) to its release "
        "(disc) or cancellation (cross); 0 is the onset. Dashed: the sound lead of {:.1f} ms and the "
        "release margin of {:.1f} ms.</p>\n<div class=plot>\n{}</div>\n",
        result.sound_lead_s * 1e3, result.release_margin_s * 1e3, plots.leads);
    if (!result.audio.empty()) text += sound_section(result, plots.sound);
    return text;
}

}  // namespace

std::string format_report(const PlayResult& result, const fs::path& scratch) {
    const std::string name = fs::path(result.trace).filename().string();
    return report_page(fmt::format("{} on {}", name, result.kit_name),
                       heading(result) + figures(result) + frames_section(result) +
                           plot_sections(result, scratch) + provenance(result));
}

}  // namespace app
