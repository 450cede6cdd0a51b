#include <fmt/format.h>
#include <openssl/evp.h>
#include <render/renderer.h>
#include <tracking/input.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "files/bad_input.h"
#include "play/film.h"
#include "play/play_plots.h"
#include "play/play_run.h"
#include "report/html.h"
#include "report/table.h"
#include "statistics/statistics.h"
#include "strikes/true_contacts.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr int kFilmWidth = 240;  // pixels
constexpr int kSlowness = 6;
constexpr double kLongestSoundWithinS = 300;  // about 5 MB of text

std::string base64(std::string_view bytes) {
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
    const double shown_s = result.t0_s + static_cast<double>(frame_number(file)) / result.options.fps;
    const std::string note = nearest_note(result, shown_s);
    return fmt::format("{:.3f} s{}{}", shown_s, note.empty() ? "" : ": ", note);
}

std::string frames_section(const PlayResult& result, const FrameAtHand& frame_at_hand) {
    if (result.pictures.frames.empty()) return {};
    std::string text = "<h2>Frames</h2>\n<div class=frames>\n";
    for (const fs::path& file : result.pictures.frames) {
        (void)frame_at_hand(frame_number(file));
        const std::string caption = html(frame_caption(result, file));
        fmt::format_to(
            std::back_inserter(text),
            "<figure><img width={} height={} alt=\"frame shown at {}\" src=\"data:image/png;base64,{}\">"
            "<figcaption>{}</figcaption></figure>\n",
            result.options.width, result.options.height, caption,
            base64(tracking::read_bytes(file.string(), "a picture")), caption);
    }
    return text + "</div>\n";
}

/// The loudest strokes in slow motion: pictures side by side of which the page shows one after the other. By
/// time, and each frame as soon as it is written: when the last is, little is left to do.
std::string films_section(const PlayResult& result, const FrameAtHand& frame_at_hand) {
    std::multimap<std::uint64_t, std::size_t> by_time;  // of the films, whose order is that of their loudness
    for (std::size_t i = 0; i < result.pictures.films.size(); ++i)
        by_time.emplace(frame_number(result.pictures.films[i].files.front()), i);
    std::vector<std::string> figures(result.pictures.films.size());
    for (const auto& [start, i] : by_time) {
        const Film& film = result.pictures.films[i];
        const render::Image strip = film_strip(
            film, kFilmWidth, [&](const fs::path& file) { return frame_at_hand(frame_number(file)); });
        if (strip.rgb.empty()) continue;
        const std::vector<std::uint8_t> png = render::encode_png(strip);
        const std::size_t count = film.files.size();
        figures[i] = fmt::format(
            "<figure><div class=film style=\"--n:{};--s:{:.2f}s;aspect-ratio:{}/{}\"><img alt=\"{} "
            "frames\" src=\"data:image/png;base64,{}\"></div><figcaption>{}</figcaption></figure>\n",
            count, kSlowness * static_cast<double>(count) * film.frame_s,
            strip.width / static_cast<int>(count), strip.height, count,
            base64({reinterpret_cast<const char*>(png.data()), png.size()}),
            html(frame_caption(result, film.files[film.struck])));
    }
    std::string films;
    for (const std::string& figure : figures) films += figure;
    if (films.empty()) return {};
    return fmt::format(
        "<h2>Strokes</h2>\n<p class=note>The loudest ones that lie apart, {} times slower than they were "
        "played; "
        "the bar below turns green where the note begins.</p>\n<div class=frames>\n{}</div>\n",
        kSlowness, films);
}

/// What can be seen beside the page.
std::string video_section(const PlayResult& result) {
    if (result.pictures.video.empty()) return {};
    return fmt::format(
        "<h2>Video</h2>\n<video controls preload=metadata src=\"{}\"></video>\n"
        "<p class=note>{}, which the page shows while it lies where it was made.</p>\n",
        html(result.pictures.video), html(result.options.video->filename().string()));
}

/// What can be heard: the sound lies within the page while it is short.
std::string listen_section(const PlayResult& result) {
    std::string text;
    if (result.sound.samples.empty()) return text;
    const double length_s = static_cast<double>(result.sound.samples.size() / 2) / audio::kSampleRate;
    const bool within = length_s <= kLongestSoundWithinS;
    const std::string source =
        within ? "data:audio/mpeg;base64," +
                     base64(audio::encode_mp3({result.sound.samples.data(), result.sound.samples.size()}))
               : "audio.wav";
    fmt::format_to(std::back_inserter(text),
                   "<h2>Listen</h2>\n<audio controls preload=metadata src=\"{}\"></audio>\n"
                   "<p class=note>{:.1f} s. {}</p>\n",
                   source, length_s,
                   within ? "An MP3 copy within this page; the sound itself is audio.wav."
                          : "The page plays audio.wav, which must lie beside it.");
    return text;
}

std::string legend(const PlayResult& result) {
    std::vector<std::pair<std::string, std::string>> entries;
    for (std::size_t i = 0; i < result.tracks.size(); ++i)
        entries.emplace_back(line_shape(stick_colour(i)), "tip of " + result.tracks[i].stick);
    entries.insert(
        entries.end(),
        {{R"svg(<circle cx="11" cy="6" r="4.2" fill="none" stroke="var(--contact)" stroke-width="1.5"/>)svg",
          "true contact"},
         {R"svg(<circle cx="11" cy="6" r="3.4" fill="var(--released)"/>)svg", "note at its onset"},
         {R"svg(<path d="M11,11l-5,-9h10z" fill="var(--wrong)"/>)svg", "false note"},
         {R"svg(<path d="M7,2h8v8h-8z" fill="none" stroke="var(--missed)" stroke-width="1.5"/>)svg",
          "missed contact"},
         {R"svg(<path d="M7,2l8,8M15,2l-8,8" stroke="var(--cancelled)" stroke-width="1.5"/>)svg",
          "cancelled note"}});
    return report_legend(entries);
}

std::string percent(int part, int whole) {
    return whole > 0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "none";
}

/// Rounded to tenths, without a negative zero.
double tenths(double value) {
    return std::round(value * 10) / 10 + 0.0;
}

std::string heading(const PlayResult& r) {
    const PlayOptions& o = r.options;
    return report_header(
        fs::path(r.trace).filename().string(), fmt::format("played on {} by MusicWorld", r.kit_name),
        {{"trace", r.trace},
         {"recorded from", r.trace_source},
         {"kit", o.kit.string()},
         {"duration", fmt::format("{:.3f} s ({:.3f} s to {:.3f} s)", r.t_end_s - r.t0_s, r.t0_s, r.t_end_s)},
         {"pictures predicted by",
          fmt::format("{}, {:.1f} ms ahead", o.picture_predictor, o.render_lead_s * 1e3)},
         {"sounds predicted by",
          fmt::format("{}, up to {:.1f} ms ahead", o.sound_predictor, o.sound_lead_s * 1e3)},
         {"sounds are fixed", fmt::format("{:.1f} ms before their onset; cancelling is {}",
                                          o.release_margin_s * 1e3, o.cancelling ? "on" : "off")},
         {"frames", fmt::format("{} of {} x {}, {:g} per second", r.frames, o.width, o.height, o.fps)}});
}

std::string figures(const PlayResult& r) {
    const StrikeScore& s = r.score;
    const auto ms = [&](double value) {
        return s.released > s.false_notes ? fmt::format("{:.1f} ms", value) : std::string("none");
    };
    return report_figures({{std::to_string(s.true_contacts), "true contacts", "contact"},
                           {std::to_string(s.released), "released", "released"},
                           {std::to_string(s.cancelled), "cancelled", "cancelled"},
                           {std::to_string(s.moved), "moved", "axis"},
                           {std::to_string(s.false_notes), "false", "wrong"},
                           {std::to_string(s.missed), "missed", "missed"},
                           {ms(s.timing_median_ms), "median error", "axis"},
                           {ms(s.timing_p95_ms), "95 % error", "axis"}}) +
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
    using Counts = std::array<int, 5>;  // by Mark::Kind
    std::vector<Counts> counts(result.instruments.size(), Counts{});
    std::vector<std::vector<double>> errors_ms(result.instruments.size());
    for (const Mark& mark : marks_of(result))
        ++counts.at(mark.instrument).at(static_cast<std::size_t>(mark.kind));
    for (const MatchedNote& note : matched_notes(result))
        errors_ms.at(note.instrument).push_back(note.error_ms);
    Table table = Table::of({"instrument", "true:d", "released:d", "cancelled:d", "false:d", "missed:d",
                             "median |ms|:.1f", "median ms:+.1f"});
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const auto [contacts, missed, matched, wrong, cancelled] = counts[i];
        if (contacts + matched + wrong + cancelled == 0) continue;
        std::vector<double> sizes_ms = errors_ms[i];
        for (double& size : sizes_ms) size = std::abs(size);
        table.add({result.instruments[i], contacts, matched + wrong, cancelled, wrong, missed,
                   median(sizes_ms), tenths(median(errors_ms[i]))});
    }
    std::string text = "<h2>By instrument</h2>\n" + table.html();
    if (const std::size_t silent = counts.size() - table.rows.size(); silent > 0)
        text += fmt::format("<p class=note>{} more of the kit were not struck.</p>\n", silent);
    return text;
}

/// What feet, hands and resting tips did, by instrument.
std::string pedals_section(const PlayResult& result) {
    if (result.pedals.notes().empty() && result.pedal_moves_left_out == 0) return {};
    enum : std::size_t { strokes, closed, by_hand, by_tip, kinds };
    std::vector<std::array<int, kinds>> counts(result.instruments.size());
    for (const PedalNote& note : result.pedals.notes()) {
        const std::size_t what = note.by == PedalMove::Kind::tip      ? by_tip
                                 : is_choke(note)                     ? by_hand
                                 : note.by == PedalMove::Kind::stroke ? strokes
                                                                      : closed;
        ++counts.at(note.note.voice).at(what);
    }
    Table table =
        Table::of({"instrument", "strokes:d", "closings heard:d", "ended by pedal or hand:d", "by a tip:d"});
    for (std::size_t i = 0; i < counts.size(); ++i)
        if (const auto& c = counts[i]; c != std::array<int, kinds>{})
            table.add({result.instruments[i], c[strokes], c[closed], c[by_hand], c[by_tip]});
    std::string text = "<h2>Pedals and chokes</h2>\n" + table.html();
    if (result.pedal_moves_left_out > 0)
        text += fmt::format("<p class=note>{} outside the trace, not played.</p>\n",
                            counted(result.pedal_moves_left_out, "move"));
    return text;
}

/// Inputs and versions.
std::string provenance(const PlayResult& r) {
    Table inputs = Table::of({"file", "SHA-256"}), versions = Table::of({"part", "version"});
    for (const auto& [file, sha256] : r.origin.inputs) inputs.add({file, sha256});
    for (const auto& [name, version] : r.origin.versions) versions.add({name, version});
    versions.add({"fingerprint of this machine and build", r.origin.fingerprint});
    return "<p class=note>Times and workers, which differ between runs, are in summary.json.</p>\n"
           "<h2>Inputs</h2>\n" +
           inputs.html() + "<h2>Versions</h2>\n" + versions.html();
}

std::string timeline_section(const PlayResult& result, const PlayPlots& plots) {
    std::string text = "<h2>Timeline</h2>\n";
    if (!plots.overview.empty())
        text += fmt::format(
            "<p class=note>The whole recording: notes heard (green), false (red) and missed (purple) in "
            "each stretch. Enlarged below are the {} rows of {:g} s with the most false and missed ones, "
            "marked under the axis.</p>\n{}\n",
            plots.timeline.starts_s.size(), plots.timeline.row_s, plots.overview);
    return text + fmt::format(
                      "<p class=note>Height of the tips as recorded over the trace's clock, {:g} s per row. "
                      "A note stands "
                      "at its onset, at the point where it was predicted to strike.{}</p>\n{}{}\n",
                      plots.timeline.row_s,
                      result.sound.samples.empty() ? "" : " Under it the sound; vertical lines are onsets.",
                      legend(result), plots.rows);
}

std::string sound_section(const PlayResult& result, const PlayPlots& plots) {
    float peak = 0;
    for (const float sample : result.sound.samples) peak = std::max(peak, std::abs(sample));
    const std::string level = peak > 0 ? fmt::format("Peak {:.1f} dBFS", 20 * std::log10(peak)) : "Silence";
    return fmt::format(
        "<h2>Sound</h2>\n<p class=note>The whole file, both channels together: lowest and highest sample "
        "of each column; ticks below are onsets. {}, {} samples clipped.</p>\n{}\n"
        "<h3>Spectrogram</h3>\n<p class=note>Levels over time and frequency, of windows of 43 ms: from {:g} "
        "dB "
        "of full scale and below (dark) to {:g} dB (bright). Ticks above are onsets.</p>\n{}\n",
        level, result.sound.clipped_samples, plots.sound, plots.levels.low_db, plots.levels.high_db,
        plots.spectrogram);
}

std::string plot_sections(const PlayResult& result, Plotter& plotter) {
    PlotGallery gallery;
    const PlayPlots plots = add_play_plots(gallery, result);
    std::string text = gallery.symbols() + timeline_section(result, plots);
    text += fmt::format(
        "<h2>Timing</h2>\n<p class=note>How far each note lies from the contact that it belongs to.</p>\n"
        "<div class=pair>{}{}</div>\n",
        plots.timing, plots.instruments);
    text += instruments_section(result) + pedals_section(result);
    text += fmt::format(
        "<h2>When notes were decided</h2>\n<p class=note>From its first prediction (ring) to its release "
        "(disc) or cancellation (cross); 0 is the onset. Dashed: the sound lead of {:.1f} ms and the "
        "release margin of {:.1f} ms.</p>\n{}\n",
        result.options.sound_lead_s * 1e3, result.options.release_margin_s * 1e3, plots.leads);
    if (!plots.sound.empty()) text += sound_section(result, plots);
    return gallery.drawn(std::move(text), plotter);
}

}  // namespace

ReportSections report_sections(const PlayResult& result, Plotter& plotter, const FrameAtHand& frame_at_hand) {
    ReportSections sections{listen_section(result), plot_sections(result, plotter), {}, {}};
    sections.films = films_section(result, frame_at_hand);
    sections.frames = frames_section(result, frame_at_hand);
    return sections;
}

std::string format_report(const PlayResult& result, const ReportSections& sections) {
    const std::string name = fs::path(result.trace).filename().string();
    return report_page(fmt::format("{} on {}", name, result.kit_name),
                       heading(result) + figures(result) + video_section(result) + sections.listen +
                           sections.films + sections.frames + sections.plots + provenance(result));
}

}  // namespace app
