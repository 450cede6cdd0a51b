#include "play_command.h"

#include <fmt/format.h>

#include <memory>

#include "kit.h"
#include "numbers.h"
#include "play.h"
#include "play_realtime.h"
#include "realtime_arguments.h"
#include "trace_files.h"

namespace app {
namespace {

/// The options as typed.
struct PlayArguments {
    std::string trace, kit = "drums", out = "out", fps = "30", size = "640x480";
    std::string predictor, picture_predictor, sound_predictor;
    std::string render_lead = "1/30", sound_lead = "1/15", release_margin = "0.010";
    std::string tip, shaft, video;
    int workers = 1;
    std::int64_t solo = -1;  // none
    bool no_cancel = false, no_frames = false, no_audio = false;
    bool realtime = false;
    RealtimeArguments in_time;
};

PlayOptions options_of(const PlayArguments& a) {
    PlayOptions o;
    o.trace = find_trace(a.trace.empty() ? "flourish" : a.trace);
    o.kit = find_kit(a.kit);
    o.out = a.out;
    o.fps = parse_number(a.fps, "--fps");
    const Eigen::Vector2i size = parse_size(a.size, "--size");
    o.width = size.x(), o.height = size.y();
    const std::string both = a.predictor.empty() ? "auto" : a.predictor;
    o.picture_predictor = a.picture_predictor.empty() ? both : a.picture_predictor;
    o.sound_predictor = a.sound_predictor.empty() ? both : a.sound_predictor;
    o.render_lead_s = parse_number(a.render_lead, "--render-lead");
    o.sound_lead_s = parse_number(a.sound_lead, "--sound-lead");
    o.release_margin_s = parse_number(a.release_margin, "--release-margin");
    o.workers = a.workers;
    o.cancelling = !a.no_cancel;
    o.frames = !a.no_frames;
    o.audio = !a.no_audio;
    if (a.solo >= 0) o.solo = static_cast<std::uint64_t>(a.solo);
    if (!a.tip.empty()) o.tip = parse_vector(a.tip, "--tip");
    if (!a.shaft.empty()) o.shaft = parse_axis(a.shaft, "--shaft");
    if (!a.video.empty()) o.video = a.video;
    o.progress = true;
    return o;
}

void print_places(const PlayOptions& options) {
    fmt::print("Look at {}", (options.out / "report.html").string());
    if (options.audio) fmt::print(", listen to {}", (options.out / "audio.wav").string());
    if (options.frames) fmt::print(", see {}", (options.out / "frames").string());
    fmt::print("\n");
}

void print_result(const PlayResult& result, const PlayOptions& options) {
    const StrikeScore& s = result.score;
    const int sounded = s.true_contacts - s.missed;
    fmt::print(
        "{} strikes of {} sounded, {} false, {} cancelled; median timing error {}; {:.1f} times real time\n",
        sounded, s.true_contacts, s.false_notes, s.cancelled,
        sounded > 0 ? fmt::format("{:.1f} ms", s.timing_median_ms) : "unknown (nothing matched)",
        (result.t_end_s - result.t0_s) / result.wall_s);
    print_places(options);
}

void play_in_time(const RealtimeOptions& options) {
    const RealtimeOutcome outcome =
        play_realtime(options, [](const std::string& line) { fmt::print(stderr, "{}\n", line); });
    const StrikeScore& s = outcome.play.score;
    const RealtimeResult& r = outcome.realtime;
    const auto missed = std::ranges::count_if(r.frames, [](const FrameTiming& frame) {
        return frame.asked_for && frame.fate != FrameFate::in_time;
    });
    const auto late = std::ranges::count_if(r.notes, [](const NoteTiming& note) { return note.late_s > 0; });
    const auto unexplained = std::ranges::count_if(
        outcome.departures, [](const Departure& d) { return d.cause == "unexplained"; });
    fmt::print(
        "{:.1f} s in real time: {} strikes of {} sounded, {} false, {} cancelled; {} of {} frames missed, {} "
        "of {} notes late\n",
        r.seconds, s.true_contacts - s.missed, s.true_contacts, s.false_notes, s.cancelled, missed,
        r.frames.size(), late, r.notes.size());
    if (outcome.offline_strikes > 0)
        fmt::print("{} strikes offline: {} depart from them here, {} unexplained ({})\n",
                   outcome.offline_strikes, outcome.departures.size(), unexplained,
                   (options.play.out / "departures.csv").string());
    print_places(options.play);
}

}  // namespace

void add_play_command(CLI::App& program) {
    CLI::App* play_command = program.add_subcommand("play", "Play a recorded trace into pictures and sound");
    auto a = std::make_shared<PlayArguments>();
    play_command->add_option(
        "TRACE", a->trace,
        "Trace (CSV, Beat Saber replay, or the name of a bundled one); the bundled flourish if left out");
    play_command->add_option("--kit", a->kit, "Kit: a file, or the name of a bundled one")
        ->capture_default_str();
    play_command->add_option("--out", a->out, "Folder for the products")->capture_default_str();
    play_command->add_option("--fps", a->fps, "Frames a second")->capture_default_str();
    play_command->add_option("--size", a->size, "Size of the frames")->capture_default_str();
    CLI::Option* both = play_command->add_option("--predictor", a->predictor,
                                                 "Predictor of pictures and sound (default auto)");
    play_command->add_option("--picture-predictor", a->picture_predictor, "Predictor of pictures")
        ->excludes(both);
    play_command->add_option("--sound-predictor", a->sound_predictor, "Predictor of sound")->excludes(both);
    play_command->add_option("--render-lead", a->render_lead, "Lead of pictures [s]")->capture_default_str();
    play_command->add_option("--sound-lead", a->sound_lead, "Lead of sound [s]")->capture_default_str();
    play_command
        ->add_option("--release-margin", a->release_margin, "A note is fixed this long before its onset [s]")
        ->capture_default_str();
    play_command->add_option("--workers", a->workers, "Worker processes of the simulation; 0: none")
        ->capture_default_str();
    play_command->add_option("--tip", a->tip, "Tip in the tracked body's frame, X,Y,Z [m]");
    play_command->add_option("--shaft", a->shaft, "Body axis from hand to tip, e.g. -z");
    play_command->add_option("--solo", a->solo,
                             "Render the sound of one note alone, by its id in events.csv");
    play_command->add_option("--video", a->video, "Also make a video (MP4) of frames and sound");
    play_command->add_flag("--no-cancel", a->no_cancel, "Play every scheduled note, also those of feints");
    play_command->add_flag("--no-frames", a->no_frames, "Draw nothing");
    play_command->add_flag("--no-audio", a->no_audio, "Sound nothing");
    CLI::Option* realtime = play_command->add_flag(
        "--realtime", a->realtime, "Play against the wall clock, sensors in processes of their own");
    for (CLI::Option* option : add_realtime_options(*play_command, a->in_time)) option->needs(realtime);
    play_command->callback([a] {
        const PlayOptions options = options_of(*a);
        if (a->realtime) {
            play_in_time(realtime_options(options, a->in_time));
            return;
        }
        print_result(play(options), options);
    });
}

}  // namespace app
