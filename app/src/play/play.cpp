#include "play/play.h"

#include <fmt/format.h>

#include <memory>

#include "files/bad_input.h"
#include "files/output_folder.h"
#include "kit/tip_track.h"
#include "play/offline_run.h"
#include "play/play_products.h"
#include "play/play_setup.h"
#include "process/clock.h"
#include "process/progress_bar.h"

namespace app {
namespace {

void check_solo(const PlayOptions& options, const std::vector<Strike>& strikes) {
    if (!options.solo) return;
    const bool released = *options.solo >= 1 && *options.solo <= strikes.size() &&
                          strikes[*options.solo - 1].outcome == Outcome::released;
    if (!released)
        throw BadInput(fmt::format("error: found --solo {}, expected the id of a released note of events.csv",
                                   *options.solo));
}

/// The loop, from samples to strikes.
void play_through(OfflineRun& run, const PlayOptions& options, PlayResult& result) {
    ProgressBar bar(options.progress);
    run.run([&](double done) { bar.show(done); });
    bar.clear();
    result.strikes = run.strikes();
    check_solo(options, result.strikes);
    result.samples_refused = run.refused();
    const LoopTimes times = run.times();
    result.stages_s.insert(result.stages_s.end(), {{"tracking", times.tracking},
                                                   {"simulation", times.simulation},
                                                   {"strikes", times.strikes},
                                                   {"waiting for frames", times.waiting_for_frames}});
}

}  // namespace

PlayResult play(const PlayOptions& options) {
    const WallTimer wall;
    const tracking::Trace trace = read_played_trace(options.trace);
    const Kit kit = read_kit(options.kit);
    const StickGeometry stick = stick_geometry(trace, kit.stick, options.tip, options.shaft);
    PlayResult result = describe(options, trace, kit);
    result.tracks = tip_tracks(trace, stick);
    OutputFolder folder(options.out);

    const KitStage stage(kit, trace.sticks.size(), stick);
    const std::unique_ptr<FrameThread> frames =
        start_frames(options, {stage.scene(options.width, options.height)}, stage.frame({}, {}), folder);
    const auto sound =
        options.audio ? std::make_unique<audio::Performance>(orchestra_file(), voices_of(kit)) : nullptr;
    const std::unique_ptr<sim::Simulation> simulation = make_simulation(kit, options.workers);
    result.stages_s.emplace_back("start", wall.seconds());

    OfflineRun run(trace, kit, options, stick, *simulation, stage, frames.get(), sound.get());
    play_through(run, options, result);
    const double sound_s = seconds_of([&] {
        if (sound) finish_sound(*sound, trace.t_end_s() - trace.t0_s(), result, folder);
    });
    result.stages_s.emplace_back("sound (waiting and writing)", sound_s);
    write_products(result, {options, kit, stick, *simulation, frames.get(), wall}, folder);
    return result;
}

}  // namespace app
