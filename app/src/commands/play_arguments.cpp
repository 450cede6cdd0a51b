#include "commands/play_arguments.h"

#include "files/assets.h"
#include "files/option_values.h"
#include "kit/kit.h"

namespace app {

void add_play_options(CLI::App& command, PlayArguments& a) {
    command.add_option(
        "TRACE", a.trace,
        "Trace (CSV, Beat Saber replay, or the name of a bundled one); the bundled flourish if left out");
    command.add_option("--kit", a.kit, "Kit: a file, or the name of a bundled one")->capture_default_str();
    command.add_option("--fps", a.fps, "Frames a second")->capture_default_str();
    command.add_option("--size", a.size, "Size of the frames")->capture_default_str();
    CLI::Option* both =
        command.add_option("--predictor", a.predictor, "Predictor of pictures and sound (default auto)");
    command.add_option("--picture-predictor", a.picture_predictor, "Predictor of pictures")->excludes(both);
    command.add_option("--sound-predictor", a.sound_predictor, "Predictor of sound")->excludes(both);
    command.add_option("--render-lead", a.render_lead, "Lead of pictures [s]")->capture_default_str();
    command.add_option("--sound-lead", a.sound_lead, "Lead of sound [s]")->capture_default_str();
    command
        .add_option("--release-margin", a.release_margin, "A note is fixed this long before its onset [s]")
        ->capture_default_str();
    command.add_option("--workers", a.workers, "Worker processes of the simulation; 0: none")
        ->capture_default_str();
    command.add_option("--tip", a.tip, "Tip in the tracked body's frame, X,Y,Z [m]");
    command.add_option("--shaft", a.shaft, "Body axis from hand to tip, e.g. -z");
    command.add_flag("--no-cancel", a.no_cancel, "Play every scheduled note, also those of feints");
    command.add_flag("--no-frames", a.no_frames, "Draw nothing");
    command.add_flag("--no-audio", a.no_audio, "Sound nothing");
}

PlayOptions play_options(const PlayArguments& a) {
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
    if (!a.tip.empty()) o.tip = parse_vector(a.tip, "--tip");
    if (!a.shaft.empty()) o.shaft = parse_axis(a.shaft, "--shaft");
    o.progress = true;
    return o;
}

}  // namespace app
