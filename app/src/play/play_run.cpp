#include "play/play_run.h"

#include <fmt/format.h>
#include <tracking/input.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string_view>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/checksum.h"
#include "play/film.h"
#include "report/json_document.h"
#include "report/table.h"
#include "sticks/predictors.h"
#include "strikes/strike_note.h"
#include "strikes/true_contacts.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestHours = 3;

constexpr double kApartS = 0.5;  // between the notes whose frames the report shows

/// True contacts of the recorded paths, and how the notes compare with them.
void score(PlayResult& result, const Kit& kit, const StickGeometry& stick) {
    const std::vector<sim::BodyDefinition> bodies = bodies_of(kit);
    result.contacts = find_true_contacts(result.tracks, bodies, stick.radius_m);
    result.score = score_strikes(result.strikes, result.contacts);
    count_turns(result.score, result.strikes, result.contacts, result.tracks, bodies, stick.radius_m,
                result.options.release_margin_s);
}

/// The loudest notes that lie apart, at most `most`.
std::vector<const Strike*> loudest_notes(const PlayResult& result, std::size_t most) {
    std::vector<const Strike*> loudest;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released) loudest.push_back(&strike);
    std::stable_sort(loudest.begin(), loudest.end(),
                     [](const Strike* a, const Strike* b) { return a->speed_mps > b->speed_mps; });
    std::vector<const Strike*> shown;
    for (const Strike* strike : loudest) {
        if (shown.size() == most) break;
        const auto is_near = [&](const Strike* other) {
            return std::abs(strike->onset_s - other->onset_s) <= kApartS;
        };
        if (std::ranges::none_of(shown, is_near)) shown.push_back(strike);
    }
    return shown;
}

/// The first frame that is shown at or after a note.
long frame_at(const PlayResult& result, const Strike& strike) {
    return static_cast<long>(std::ceil((strike.onset_s - result.t0_s) * result.options.fps));
}

/// Frames for the report: at the two loudest notes that lie apart.
std::vector<fs::path> frames_to_show(const PlayResult& result, const fs::path& folder) {
    std::vector<fs::path> files;
    for (const Strike* strike : loudest_notes(result, 2))
        if (const long k = frame_at(result, *strike); k >= 0 && k < static_cast<long>(result.frames))
            files.push_back(folder / fmt::format("{:06}.png", k));
    return files;
}

/// The loudest strokes: about 30 frames a second from a sixth of a second before the note to a third after
/// it.
std::vector<Film> films_to_show(const PlayResult& result, const fs::path& folder) {
    constexpr std::size_t kFilms = 3;
    constexpr long kBefore = 5, kAfter = 10;
    const long step = std::max(1L, std::lround(result.options.fps / 30));
    std::vector<Film> films;
    for (const Strike* strike : loudest_notes(result, kFilms)) {
        Film film;
        film.frame_s = static_cast<double>(step) / result.options.fps;
        for (long i = -kBefore; i <= kAfter; ++i) {
            const long k = frame_at(result, *strike) + i * step;
            if (k < 0 || k >= static_cast<long>(result.frames)) continue;
            if (i < 0) ++film.struck;
            film.files.push_back(folder / fmt::format("{:06}.png", k));
        }
        if (film.struck < film.files.size()) films.push_back(std::move(film));
    }
    return films;
}

/// What the report shows of the frames, some of which may still be drawn.
void choose_frames(PlayResult& result, FrameThread& frames, const fs::path& folder) {
    if (result.frames == 0) result.frames = frames.pushed();
    result.pictures.frames = frames_to_show(result, folder);
    if (!result.options.video) result.pictures.films = films_to_show(result, folder);
    std::vector<std::uint64_t> shown;
    for (const Film& film : result.pictures.films)
        for (const fs::path& file : film.files) shown.push_back(frame_number(file));
    frames.keep_pictures(shown);
}

/// Waits for the last frames; their measurements.
void take_frames(PlayResult& result, FrameThread& frames) {
    const double waited_s = seconds_of([&] { frames.finish(); });
    result.stages_s.emplace_back("drawing (own thread)", frames.report().draw_s);
    result.stages_s.emplace_back("writing frames (own thread)", frames.report().write_s);
    result.stages_s.emplace_back("frames (waiting at the end)", waited_s);
    result.origin.versions.emplace_back("renderer", frames.report().version);
}

/// A file as a page in a folder refers to it: a relative address (RFC 3986).
std::string link_to(const fs::path& file, const fs::path& folder) {
    // Absolute first: of a relative name of which nothing exists weakly_canonical() makes no absolute one.
    const auto whole = [](const fs::path& path) { return fs::weakly_canonical(fs::absolute(path)); };
    const fs::path relative = whole(file).lexically_relative(whole(folder));
    std::string link;
    for (const char c : relative.generic_string()) {
        const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                           std::string_view("/-._~").find(c) != std::string_view::npos;
        link += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return link;
}

/// After the last frame the sound rings out: how many frames more until it has ended.
std::size_t frames_after_last(const PlayResult& result) {
    const double sound_s = static_cast<double>(result.sound.samples.size()) / (2 * audio::kSampleRate);
    const double more = std::ceil(sound_s * result.options.fps - 1e-6) - static_cast<double>(result.frames);
    return static_cast<std::size_t>(std::max(0.0, more));
}

using Json = nlohmann::ordered_json;

template <typename Value>
Json object_json(const std::vector<std::pair<std::string, Value>>& pairs) {
    Json out = Json::object();
    for (const auto& [name, value] : pairs) out[name] = value;
    return out;
}

Json or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

std::string_view outcome_word(const Strike& strike) {
    if (strike.outcome == Outcome::pending)
        throw std::logic_error(
            fmt::format("strike {} of a finished run is neither released nor cancelled", strike.id));
    return strike.outcome == Outcome::released ? "released" : "cancelled";
}

}  // namespace

PlayedTrace read_played_trace(const fs::path& file) {
    const std::string bytes = tracking::read_bytes(file.string());
    PlayedTrace trace{tracking::parse_trace(bytes, file.string()), sha256_of(bytes)};
    if (const double hours = (trace.t_end_s() - trace.t0_s()) / 3600; hours > kLongestHours)
        throw BadInput(fmt::format(
            "{}: error: found {:.3g} hours between the first sample and the last, expected at most {}; "
            "are there two clocks in it?",
            file.string(), hours, kLongestHours));
    return trace;
}

std::vector<audio::Voice> voices_of(const Kit& kit) {
    std::vector<audio::Voice> voices;
    for (const Instrument& instrument : kit.instruments) voices.push_back(instrument.voice);
    return voices;
}

std::vector<audio::Note> notes_of(const PlayResult& result, const Kit& kit) {
    std::vector<audio::Note> notes;
    for (const Strike& strike : result.strikes) {
        if (strike.outcome != Outcome::released) continue;
        result.pedals.put_on(notes.emplace_back(note_of(strike, kit.instruments[strike.instrument])));
    }
    for (const PedalNote& pedal : result.pedals.notes()) notes.push_back(pedal.note);
    notes.insert(notes.end(), result.pedals.places().begin(), result.pedals.places().end());
    std::ranges::stable_sort(notes, {}, &audio::Note::onset_sample);
    return notes;
}

fs::path orchestra_file() {
    return assets_folder() / "orchestra" / "musicworld.orc";
}

PipelineSettings pipeline_settings(const PlayOptions& options, const StickGeometry& stick, double t0_s) {
    return {.t0_s = t0_s,
            .tip_radius_m = stick.radius_m,
            .render_lead_s = options.render_lead_s,
            .release_margin_s = options.release_margin_s,
            .false_cost = options.false_cost,
            .cancelling = options.cancelling};
}

std::unique_ptr<sim::Simulation> make_simulation(const Kit& kit, int workers) {
    if (workers == 0) return sim::make_local_simulation(bodies_of(kit));
    return sim::make_distributed_simulation(
        bodies_of(kit), {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers});
}

std::unique_ptr<FrameThread> start_frames(const PlayOptions& options,
                                          const std::vector<render::SceneDescription>& scenes,
                                          const render::FrameState& rest, const OutputFolder& folder,
                                          FramePolicy policy, bool realtime_priority) {
    if (!options.frames) return nullptr;
    const FrameThreadOptions where{options.width, options.height, folder.path("frames"), policy,
                                   realtime_priority};
    fs::create_directory(where.folder);
    return std::make_unique<FrameThread>(scenes, rest, where);
}

void require_tools(const PlayOptions& options) {
    require_gnuplot();
    if (options.video) require_ffmpeg();
}

PlayResult describe(const PlayOptions& options, const PlayedTrace& trace, const Kit& kit) {
    if (options.mix.bus_stems && kit.buses.empty())
        throw BadInput(
            fmt::format("error: found --bus-stems with the kit {}, which has no [[bus]], expected one; "
                        "--stems writes a file each instrument",
                        options.kit.string()));
    PlayResult result;
    result.options = options;
    result.options.picture_predictor = picture_specification(options.picture_predictor);
    result.options.sound_predictor = sound_specification(options.sound_predictor);
    if (const std::string& sound = result.options.sound_predictor; !is_external(sound))
        result.sound_models = make_any_predictor(sound, {})->models();
    result.trace = trace.file;
    result.kit_name = kit.name;
    result.trace_source = trace.source;
    result.t0_s = trace.t0_s();
    result.t_end_s = trace.t_end_s();
    for (const tracking::StickTrace& stick : trace.sticks) result.sticks.push_back(stick.name);
    for (const Instrument& instrument : kit.instruments) {
        result.instruments.push_back(instrument.name);
        result.middles.push_back(instrument.body.world_from_body.translation());
        if (instrument.fitted)
            result.contact_shapes.push_back(
                {instrument.name, *instrument.fitted, 2 * instrument.body.shape.semi_axes.maxCoeff()});
    }
    if (!trace.sha256.empty()) result.origin.inputs.emplace_back(options.trace.string(), trace.sha256);
    if (options.pedals)
        result.origin.inputs.emplace_back(options.pedals->string(), sha256_of_file(*options.pedals));
    for (const auto* files : {&kit.files, &kit.sound_files})
        for (const fs::path& file : *files)
            result.origin.inputs.emplace_back(file.string(), sha256_of_file(file));
    std::set<fs::path> models;
    for (const std::string& each : {result.options.picture_predictor, result.options.sound_predictor})
        if (const std::optional<fs::path> model = model_file(each)) models.insert(*model);
    for (const fs::path& model : models)
        result.origin.inputs.emplace_back(model.string(), sha256_of_file(model));
    return result;
}

void write_products(PlayResult& result, const RunParts& parts, OutputFolder& folder,
                    const std::function<std::string()>& realtime_part) {
    const PlayOptions& options = result.options;
    const auto stage = [&](const char* name, const auto& work) {
        result.stages_s.emplace_back(name, seconds_of(work));
    };
    write_file(folder.path("hits.mid"),
               audio::encode_midi(notes_of(result, parts.kit), options.mix.midi, result.pedals.controls()));
    if ((options.mix.stems || options.mix.bus_stems) && options.audio)
        stage("stems", [&] { write_stems(result, parts.kit, folder); });
    stage("scoring", [&] { score(result, parts.kit, parts.stick); });
    if (parts.frames) choose_frames(result, *parts.frames, folder.path("frames"));
    Plotter plotter(folder.scratch());
    std::optional<ReportSections> sections;  // made while frames are still drawn
    const auto frame_at_hand = [&](std::uint64_t k) { return parts.frames->take_picture(k); };
    folder.adorn(
        "", [&] { stage("report", [&] { sections = report_sections(result, plotter, frame_at_hand); }); });
    if (parts.frames) take_frames(result, *parts.frames);
    result.origin.fingerprint =
        fingerprint(parts.frames ? parts.frames->report().rest_image.rgb : std::vector<std::uint8_t>{});
    const sim::WorkerReport workers = parts.simulation.report();
    result.workers_lost = workers.lost;
    result.bodies_reowned = workers.bodies_reowned;
    result.origin.versions.emplace_back("musicworld", MUSICWORLD_VERSION);
    std::unique_ptr<OutputFile> video;
    if (options.video)
        folder.adorn("", [&] {
            stage("video", [&] {
                video = make_video(*options.video, options.fps, frames_after_last(result), options.audio,
                                   folder.path("."));
            });
        });
    if (video) result.pictures.video = link_to(*options.video, options.out);
    const std::string realtime_json = realtime_part ? realtime_part() : std::string();
    write_file(folder.path("events.csv"), format_events(result));
    write_file(folder.path("contacts.csv"), format_contacts(result));
    if (sections)
        folder.adorn("report.html", [&] {
            write_file(folder.path("report.html"), format_report(result, *sections));
            if (!plotter.failure().empty()) throw std::runtime_error(plotter.failure());
        });
    result.wall_s = parts.wall.seconds();
    write_file(folder.path("summary.json"), format_summary(result, realtime_json));
    folder.finish();
    if (video)
        folder.adorn("", [&] {
            video->finish();
            if (!options.keep_frames) folder.remove_product("frames");
        });
    result.failures = folder.failures();
}

std::string format_summary(const PlayResult& r, const std::string& realtime_json) {
    const PlayOptions& o = r.options;
    const StrikeScore& s = r.score;
    const double duration_s = r.t_end_s - r.t0_s;
    const bool any_matched = s.released > s.false_notes;
    Json inputs = Json::array();
    for (const auto& [file, sha256] : r.origin.inputs) inputs.push_back({{"file", file}, {"sha256", sha256}});
    Json summary = {
        {"trace", r.trace},
        {"kit", o.kit.string()},
        {"duration_s", duration_s},
        {"frames", r.frames},
        {"picture_predictor", o.picture_predictor},
        {"sound_predictor", o.sound_predictor},
        {"render_lead_s", o.render_lead_s},
        {"sound_lead_s", o.sound_lead_s},
        {"release_margin_s", o.release_margin_s},
        {"strikes",
         {{"true", s.true_contacts},
          {"released", s.released},
          {"cancelled", s.cancelled},
          {"moved", s.moved},
          {"false", s.false_notes},
          {"missed", s.missed},
          {"false_turned_early", s.false_turned_early},
          {"false_turned_late", s.false_turned_late}}},
        {"timing_ms",
         {{"median", any_matched ? Json(s.timing_median_ms) : Json()},
          {"p95", any_matched ? Json(s.timing_p95_ms) : Json()}}},
        {"realtime_factor", r.wall_s > 0 ? Json(duration_s / r.wall_s) : Json()},
        {"stages_s", object_json(r.stages_s)},
        {"workers", {{"count", o.workers}, {"lost", r.workers_lost}, {"bodies_reowned", r.bodies_reowned}}},
        {"inputs", inputs},
        {"fingerprint", r.origin.fingerprint},
        {"versions", object_json(r.origin.versions)},
        {"kit_name", r.kit_name},
        {"trace_source", r.trace_source},
        {"t0_s", r.t0_s},
        {"t_end_s", r.t_end_s},
        {"fps", o.fps},
        {"size", {{"width", o.width}, {"height", o.height}}},
        {"cancelling", o.cancelling},
        {"sticks", r.sticks},
        {"samples_refused", r.samples_refused},
        {"clipped_samples", r.sound.clipped_samples},
        {"speed_error",
         {{"median_percent", or_null(s.speed_median_percent)},
          {"p95_percent", or_null(s.speed_p95_percent)},
          {"median_db", or_null(s.speed_median_db)},
          {"p95_db", or_null(s.speed_p95_db)}}},
        {"place_error_mm", {{"median", or_null(s.place_median_mm)}, {"p95", or_null(s.place_p95_mm)}}},
        {"false_cost", o.false_cost},
        {"loudness",
         {{"integrated_lufs", or_null(r.sound.loudness.integrated_lufs)},
          {"range_lu", or_null(r.sound.loudness.range_lu)},
          {"true_peak_dbtp", or_null(r.sound.loudness.true_peak_dbtp)},
          {"gain_db", r.sound.gain_db}}},
        {"wall_s", r.wall_s},
    };
    if (r.pedals.moves() + r.pedal_moves_left_out > 0 || !r.pedals.notes().empty()) {
        using Kind = PedalMove::Kind;
        const auto count = [&](auto has) { return std::ranges::count_if(r.pedals.notes(), has); };
        summary["pedals"] = {
            {"moves", r.pedals.moves()},
            {"left_out", r.pedal_moves_left_out},
            {"strokes", count([](const PedalNote& n) { return n.by == Kind::stroke; })},
            {"closed", count([](const PedalNote& n) { return n.by != Kind::stroke && !is_choke(n); })},
            {"chokes", count([](const PedalNote& n) { return is_choke(n); })},
            {"chokes_by_tips", count([](const PedalNote& n) { return n.by == Kind::tip; })}};
    }
    for (const auto& [instrument, error, size_m] : r.contact_shapes)
        summary["contact_shapes"].push_back({{"instrument", instrument},
                                             {"rms_mm", 1e3 * error.rms_m},
                                             {"greatest_mm", 1e3 * error.greatest_m},
                                             {"rms_share", error.rms_m / size_m},
                                             {"greatest_share", error.greatest_m / size_m}});
    if (!realtime_json.empty()) summary["realtime"] = Json::parse(realtime_json);
    return json_document(summary);
}

std::string format_events(const PlayResult& result) {
    Table table = Table::of({"id", "stick", "instrument", "onset_s", "speed_mps", "px", "py", "pz",
                             "scheduled_at_s", "outcome", "moves", "decided_at_s", "model"});
    // Of several models in parallel, the number of the one that the note's time comes from.
    const auto model = [&](const Strike& s) {
        return result.sound_models > 1 ? fmt::format("{}#{}", result.options.sound_predictor, s.model)
                                       : result.options.sound_predictor;
    };
    for (const Strike& s : result.strikes)
        table.add({s.id, result.sticks.at(s.stick), result.instruments.at(s.instrument), s.onset_s,
                   s.speed_mps, s.point_world.x(), s.point_world.y(), s.point_world.z(), s.scheduled_at_s,
                   outcome_word(s), s.moves, s.decided_at_s, model(s)});
    for (const PedalNote& pedal : result.pedals.notes()) {
        const audio::Note& note = pedal.note;
        const Eigen::Vector3d& middle = result.middles.at(note.voice);
        const double onset_s = result.t0_s + static_cast<double>(note.onset_sample) / audio::kSampleRate;
        const bool by_tip = pedal.by == PedalMove::Kind::tip;
        const char* by = by_tip                                ? "tip"
                         : is_choke(pedal)                     ? "choke"
                         : pedal.by == PedalMove::Kind::stroke ? "pedal"
                                                               : "foot";
        table.add({note.id, by_tip ? result.sticks.at(pedal.stick) : "", result.instruments.at(note.voice),
                   onset_s, note.speed_mps, middle.x(), middle.y(), middle.z(), pedal.t_s, "released", 0,
                   onset_s, by});
    }
    return table.csv();
}

std::string format_contacts(const PlayResult& result) {
    Table table = Table::of({"t", "stick", "instrument", "speed_mps", "px", "py", "pz", "matched_id"});
    for (const TrueContact& c : result.contacts)
        table.add({c.t_s, result.sticks.at(c.stick), result.instruments.at(c.instrument), c.speed_mps,
                   c.point_world.x(), c.point_world.y(), c.point_world.z(), c.matched_id});
    return table.csv();
}

}  // namespace app
