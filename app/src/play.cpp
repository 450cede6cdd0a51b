#include "play.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>

#include "bad_input.h"
#include "checksum.h"
#include "child_process.h"
#include "notes.h"
#include "offline_run.h"
#include "output_folder.h"
#include "predictors.h"
#include "progress_bar.h"
#include "report.h"
#include "score_strikes.h"
#include "summary.h"
#include "tables.h"
#include "true_contacts.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestHours = 3;  // a WAV file holds four
constexpr double kTailS = 0.5, kLongestTailS = 10;
constexpr double kApartS = 0.5;  // between the notes whose frames the report shows

class Timer {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void refuse(bool wrong, const std::string& found, const std::string& expected) {
    if (wrong) throw BadInput(fmt::format("error: found {}, expected {}", found, expected));
}

void check(const PlayOptions& o) {
    refuse(!(o.fps >= 1 && o.fps <= 1000), fmt::format("--fps {}", o.fps), "1 to 1000 frames a second");
    refuse(o.width < 16 || o.height < 16 || o.width > 4096 || o.height > 4096,
           fmt::format("--size {}x{}", o.width, o.height), "16x16 to 4096x4096");
    refuse(o.workers < 0 || o.workers > 64, fmt::format("--workers {}", o.workers), "0 to 64");
    for (const auto& [name, lead] :
         {std::pair{"--render-lead", o.render_lead_s}, {"--sound-lead", o.sound_lead_s}})
        refuse(!(lead >= (name == std::string_view("--sound-lead") ? 0.001 : 0) && lead <= 1),
               fmt::format("{} {}", name, lead), "0 to 1 s (of sound at least 0.001 s)");
    refuse(!(o.release_margin_s >= 0 && o.release_margin_s <= o.sound_lead_s),
           fmt::format("--release-margin {}", o.release_margin_s), "0 s to the sound lead");
    if (!o.video) return;
    const std::string video = fmt::format("--video {}", o.video->string());
    refuse(!o.frames, "--video with --no-frames", "one of them");
    refuse(o.width % 2 != 0 || o.height % 2 != 0, fmt::format("--video with --size {}x{}", o.width, o.height),
           "even sides");
    std::error_code error;
    refuse(fs::is_directory(*o.video, error), video + ", which is a directory", "a file");
    const fs::path parent = o.video->parent_path();
    refuse(!parent.empty() && !fs::is_directory(parent, error), video + " in a folder that is not there",
           "an existing folder");
}

std::vector<sim::BodyDefinition> bodies_of(const Kit& kit) {
    std::vector<sim::BodyDefinition> bodies;
    for (const Instrument& instrument : kit.instruments) bodies.push_back(instrument.body);
    return bodies;
}

std::unique_ptr<sim::Simulation> make_simulation(const Kit& kit, int workers) {
    if (workers == 0) return sim::make_local_simulation(bodies_of(kit));
    return sim::make_distributed_simulation(
        bodies_of(kit), {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers});
}

std::unique_ptr<audio::Performance> make_performance(const Kit& kit) {
    std::vector<audio::Voice> voices;
    for (const Instrument& instrument : kit.instruments) voices.push_back(instrument.voice);
    return std::make_unique<audio::Performance>(assets_folder() / "orchestra" / "musicworld.orc", voices);
}

PlayResult describe(const PlayOptions& options, const tracking::Trace& trace, const Kit& kit) {
    PlayResult result;
    result.trace = options.trace.string();
    result.kit = options.kit.string();
    result.kit_name = kit.name;
    result.trace_source = trace.source;
    result.picture_predictor = picture_specification(options.picture_predictor);
    result.sound_predictor = sound_specification(options.sound_predictor);
    if (!is_external(result.sound_predictor))
        result.sound_models = tracking::make_predictor(result.sound_predictor)->models();
    result.t0_s = trace.t0_s();
    result.t_end_s = trace.t_end_s();
    result.fps = options.fps;
    result.render_lead_s = options.render_lead_s;
    result.sound_lead_s = options.sound_lead_s;
    result.release_margin_s = options.release_margin_s;
    result.cancelling = options.cancelling;
    result.width = options.width;
    result.height = options.height;
    result.workers = options.workers;
    for (const tracking::StickTrace& stick : trace.sticks) result.sticks.push_back(stick.name);
    for (const Instrument& instrument : kit.instruments) result.instruments.push_back(instrument.name);
    result.inputs.push_back({options.trace.string(), sha256_of_file(options.trace)});
    for (const fs::path& file : kit.files) result.inputs.push_back({file.string(), sha256_of_file(file)});
    return result;
}

void score(PlayResult& result, const Kit& kit, const StickGeometry& stick) {
    const std::vector<sim::BodyDefinition> bodies = bodies_of(kit);
    result.contacts = find_true_contacts(result.tracks, bodies, stick.radius_m);
    result.score = score_strikes(result.strikes, result.contacts);
    count_turns(result.score, result.strikes, result.contacts, result.tracks, bodies, stick.radius_m,
                result.release_margin_s);
}

void write_midi(const fs::path& file, const PlayResult& result, const Kit& kit) {
    std::vector<audio::Note> notes;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released)
            notes.push_back(note_of(strike, kit.instruments[strike.instrument]));
    std::stable_sort(notes.begin(), notes.end(), [](const audio::Note& a, const audio::Note& b) {
        return a.onset_sample < b.onset_sample;
    });
    audio::write_midi(file, notes);
}

/// Frames for the report: before, at and after the two loudest notes that lie apart.
std::vector<fs::path> frames_to_show(const PlayResult& result, const fs::path& folder) {
    std::vector<const Strike*> loudest;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released) loudest.push_back(&strike);
    std::stable_sort(loudest.begin(), loudest.end(),
                     [](const Strike* a, const Strike* b) { return a->speed_mps > b->speed_mps; });
    std::vector<const Strike*> shown;
    for (const Strike* strike : loudest) {
        const bool apart = shown.empty() || std::abs(strike->onset_s - shown.front()->onset_s) > kApartS;
        if (apart && shown.size() < 2) shown.push_back(strike);
    }
    std::vector<fs::path> files;
    for (const Strike* strike : shown) {
        const auto at = static_cast<long>(std::ceil((strike->onset_s - result.t0_s) * result.fps));
        for (const long k : {at - 2, at, at + 2})
            if (k >= 0 && k < static_cast<long>(result.frames))
                files.push_back(folder / fmt::format("{:06}.png", k));
    }
    return files;
}

/// Encodes frames and sound beside the video's place, as FILE.partial.
void make_video(const PlayOptions& options, const fs::path& staging) {
    std::vector<std::string> command = {"ffmpeg",
                                        "-nostdin",
                                        "-loglevel",
                                        "error",
                                        "-y",
                                        "-framerate",
                                        fmt::format("{}", options.fps),
                                        "-i",
                                        (staging / "frames" / "%06d.png").string()};
    if (options.audio) command.insert(command.end(), {"-i", (staging / "audio.wav").string(), "-c:a", "aac"});
    command.insert(command.end(), {"-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-fflags",
                                   "+bitexact", "-f", "mp4", options.video->string() + ".partial"});
    try {
        run_child(command, staging / "scratch" / "ffmpeg.log");
    } catch (...) {
        std::error_code ignored;
        fs::remove(options.video->string() + ".partial", ignored);
        throw;
    }
}

}  // namespace

PlayResult play(const PlayOptions& options) {
    const Timer wall;
    check(options);
    const tracking::Trace trace = tracking::read_trace(options.trace);
    if (const double hours = (trace.t_end_s() - trace.t0_s()) / 3600; hours > kLongestHours)
        throw BadInput(fmt::format(
            "{}: error: found {:.3g} hours between the first sample and the last, expected at most {}; "
            "are there two clocks in it?",
            options.trace.string(), hours, kLongestHours));
    const Kit kit = read_kit(options.kit);
    const StickGeometry stick = stick_geometry(trace, kit.stick, options.tip, options.shaft);
    for (const std::string& name : {options.picture_predictor, options.sound_predictor})
        check_specification(name);
    PlayResult result = describe(options, trace, kit);
    result.tracks = tip_tracks(trace, stick);
    OutputFolder folder(options.out);

    const Stage stage(kit, trace.sticks.size(), stick);
    std::unique_ptr<FrameWriter> frames;
    if (options.frames) {
        fs::create_directory(folder.path("frames"));
        frames = std::make_unique<FrameWriter>(stage.scene(options.width, options.height),
                                               stage.frame({}, {}), folder.path("frames"));
    }
    std::unique_ptr<audio::Performance> performance = options.audio ? make_performance(kit) : nullptr;
    const std::unique_ptr<sim::Simulation> simulation = make_simulation(kit, options.workers);
    result.stages_s.emplace_back("start", wall.seconds());

    OfflineRun run(trace, kit, options, stick, *simulation, stage, frames.get(), performance.get());
    ProgressBar bar(options.progress);
    run.run([&](double done) { bar.show(done); });
    bar.clear();
    result.strikes = run.strikes();
    if (options.solo && (*options.solo == 0 || *options.solo > result.strikes.size() ||
                         result.strikes[*options.solo - 1].outcome != Outcome::released))
        throw BadInput(fmt::format("error: found --solo {}, expected the id of a released note of events.csv",
                                   *options.solo));
    result.samples_refused = run.refused();
    result.stages_s.emplace_back("tracking", run.times().tracking);
    result.stages_s.emplace_back("simulation", run.times().simulation);
    result.stages_s.emplace_back("strikes", run.times().strikes);
    result.stages_s.emplace_back("waiting for frames", run.times().waiting_for_frames);

    const Timer sound;
    if (performance) {
        const double length = (trace.t_end_s() - trace.t0_s() + kTailS) * audio::kSampleRate;
        result.audio = performance->finish(static_cast<std::int64_t>(std::ceil(length)),
                                           static_cast<std::int64_t>(kLongestTailS * audio::kSampleRate));
        result.clipped_samples = audio::write_wav(folder.path("audio.wav"), result.audio);
        result.stages_s.emplace_back("sound (own thread)", performance->busy_s());
        result.versions.emplace_back("csound", performance->version());
    }
    result.stages_s.emplace_back("sound (waiting and writing)", sound.seconds());
    write_midi(folder.path("hits.mid"), result, kit);

    const Timer scoring;
    score(result, kit, stick);
    result.stages_s.emplace_back("scoring", scoring.seconds());

    std::vector<std::uint8_t> test_frame;
    if (frames) {
        const Timer waiting;
        frames->finish();
        result.frames = frames->frames();
        result.stages_s.emplace_back("drawing (own thread)", frames->draw_s());
        result.stages_s.emplace_back("writing frames (own thread)", frames->write_s());
        result.stages_s.emplace_back("frames (waiting at the end)", waiting.seconds());
        result.versions.emplace_back("renderer", frames->version());
        test_frame = frames->rest_image().rgb;
        result.report_frames = frames_to_show(result, folder.path("frames"));
    }
    result.fingerprint = fingerprint(test_frame);
    const sim::WorkerReport workers = simulation->report();
    result.workers_lost = workers.lost;
    result.bodies_reowned = workers.bodies_reowned;
    result.versions.emplace_back("musicworld", MUSICWORLD_VERSION);

    if (options.video) {
        const Timer video;
        make_video(options, folder.path("."));
        result.stages_s.emplace_back("video", video.seconds());
    }
    write_file(folder.path("events.csv"), format_events(result));
    write_file(folder.path("contacts.csv"), format_contacts(result));
    const Timer reporting;
    result.wall_s = wall.seconds();
    write_file(folder.path("report.html"), format_report(result, folder.scratch()));
    result.stages_s.emplace_back("report", reporting.seconds());
    result.wall_s = wall.seconds();
    write_file(folder.path("summary.json"), format_summary(result));
    folder.finish();
    if (options.video) fs::rename(options.video->string() + ".partial", *options.video);
    return result;
}

}  // namespace app
