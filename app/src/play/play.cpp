#include "play/play.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "files/bad_input.h"
#include "files/checksum.h"
#include "files/output_folder.h"
#include "pictures/video.h"
#include "play/offline_run.h"
#include "play/play_products.h"
#include "play/play_report.h"
#include "play/play_setup.h"
#include "play/summary.h"
#include "play/tables.h"
#include "process/clock.h"
#include "process/progress_bar.h"

namespace app {
namespace fs = std::filesystem;
PlayResult play(const PlayOptions& options) {
    const WallTimer wall;
    const tracking::Trace trace = read_played_trace(options.trace);
    const Kit kit = read_kit(options.kit);
    const StickGeometry stick = stick_geometry(trace, kit.stick, options.tip, options.shaft);
    PlayResult result = describe(options, trace, kit);
    result.tracks = tip_tracks(trace, stick);
    OutputFolder folder(options.out);

    const KitStage stage(kit, trace.sticks.size(), stick);
    std::unique_ptr<FrameWriter> frames;
    if (options.frames) {
        fs::create_directory(folder.path("frames"));
        frames = std::make_unique<FrameWriter>(stage.scene(options.width, options.height),
                                               stage.frame({}, {}), folder.path("frames"));
    }
    std::unique_ptr<audio::Performance> performance =
        options.audio ? std::make_unique<audio::Performance>(orchestra_file(), voices_of(kit)) : nullptr;
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

    const WallTimer sound;
    if (performance) {
        const double length = (trace.t_end_s() - trace.t0_s() + kSoundTailS) * audio::kSampleRate;
        result.audio =
            performance->finish(static_cast<std::int64_t>(std::ceil(length)),
                                static_cast<std::int64_t>(kLongestSoundTailS * audio::kSampleRate));
        result.clipped_samples = audio::write_wav(folder.path("audio.wav"), result.audio);
        result.stages_s.emplace_back("sound (own thread)", performance->busy_s());
        result.versions.emplace_back("csound", performance->version());
    }
    result.stages_s.emplace_back("sound (waiting and writing)", sound.seconds());
    write_hits(folder.path("hits.mid"), result, kit);

    const WallTimer scoring;
    score(result, kit, stick);
    result.stages_s.emplace_back("scoring", scoring.seconds());

    std::vector<std::uint8_t> test_frame;
    if (frames) {
        const WallTimer waiting;
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
        const WallTimer video;
        make_video(*options.video, options.fps, options.audio, folder.path("."));
        result.stages_s.emplace_back("video", video.seconds());
    }
    write_file(folder.path("events.csv"), format_events(result));
    write_file(folder.path("contacts.csv"), format_contacts(result));
    const WallTimer reporting;
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
