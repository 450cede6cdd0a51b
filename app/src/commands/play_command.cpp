#include "commands/play_command.h"

#include <fmt/format.h>
#include <sim/simulation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <tuple>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "play/play.h"
#include "process/standard_streams.h"
#include "sticks/learned_in_play.h"
#include "sticks/predictors.h"
#include "strikes/true_contacts.h"

namespace app {
namespace {

void print_places(const PlayResult& result) {
    const PlayOptions& options = result.options;
    std::error_code none;
    const bool frames_kept = options.frames && fs::exists(options.out / "frames", none);
    fmt::print("Look at {}", (options.out / "report.html").string());
    if (options.audio) fmt::print(", listen to {}", (options.out / "audio.wav").string());
    if (frames_kept) fmt::print(", see {}", (options.out / "frames").string());
    if (options.video && result.failures.empty()) fmt::print(", watch {}", options.video->string());
    fmt::print("\n");
}

std::string strikes_text(const StrikeScore& s) {
    return fmt::format("{} of {} sounded, {} false, {} cancelled", s.true_contacts - s.missed,
                       counted(s.true_contacts, "strike"), s.false_notes, s.cancelled);
}

/// Where a tip came nearest to an instrument.
struct NearestMiss {
    double distance_m = std::numeric_limits<double>::infinity();
    std::string instrument, stick;
    double t_s = 0;
};
NearestMiss nearest_miss(const PlayResult& result, const Kit& kit) {
    constexpr std::size_t kMostSamples = 20000;  // of a stick: long recordings are looked at in steps
    NearestMiss nearest;
    for (const TipTrack& track : result.tracks)
        for (std::size_t i = 0; i < track.tip.size(); i += 1 + track.tip.size() / kMostSamples)
            for (const Instrument& instrument : kit.instruments) {
                const double distance =
                    sim::rest_distance(instrument.body, track.tip[i], kit.stick.radius_m).distance;
                if (distance < nearest.distance_m)
                    nearest = {distance, instrument.name, track.stick, track.t_s[i]};
            }
    return nearest;
}

/// Says how far tips and instruments were apart if none met.
void print_if_apart(const PlayResult& result) {
    if (result.score.true_contacts + result.score.released > 0 || result.tracks.empty()) return;
    const Kit kit = read_kit(result.options.kit);
    const NearestMiss miss = nearest_miss(result, kit);
    Eigen::AlignedBox3d tips;
    for (const TipTrack& track : result.tracks)
        for (const Eigen::Vector3d& tip : track.tip) tips.extend(tip);
    fmt::print(
        "no stick met an instrument: stick {} came nearest, {:.3f} m from \"{}\" at {:.2f} s; the tips moved "
        "within "
        "({:.2f}) to ({:.2f}) m; check --tip, or place a kit where they strike with `kit fit {} --out "
        "fitted.toml`\n",
        miss.stick, miss.distance_m, miss.instrument, miss.t_s, fmt::join(tips.min(), ", "),
        fmt::join(tips.max(), ", "), result.trace);
}

/// Says where the sound is not as loud as it was asked for, which its peaks forbid, and where samples clipped.
void print_if_loud(const PlayResult& result, bool offline) {
    const MixOptions& asked = result.options.mix;
    const audio::Loudness& loudness = result.sound.loudness;
    const bool brought = offline && !asked.gain_db && !result.options.solo && loudness.integrated_lufs;
    if (brought && std::abs(*loudness.integrated_lufs - asked.loudness_lufs) > 1)
        fmt::print(
            "the sound is at {:.1f} LUFS, not at {:g}, as its peaks reach {:.1f} dBTP; --gain shifts it all "
            "the same\n",
            *loudness.integrated_lufs, asked.loudness_lufs, loudness.true_peak_dbtp.value_or(0));
    if (result.sound.clipped_samples > 0)
        fmt::print("{} of the sound clipped; less gain avoids it (--gain, or gain_db of the kit)\n",
                   counted(result.sound.clipped_samples, "sample"));
}

void print_left_out(const PlayResult& result) {
    if (result.pedal_moves_left_out > 0)
        fmt::print("{} of {} before or after the trace: not played\n",
                   counted(result.pedal_moves_left_out, "move"), result.options.pedals->string());
}

void print_lost(const PlayResult& result) {
    if (result.workers_lost > 0)
        fmt::print("{} lost; {} went to others\n", counted(result.workers_lost, "worker"),
                   counted(result.bodies_reowned, "body"));
}

void play_offline(const PlayOptions& options) {
    const PlayResult result = play(options);
    const StrikeScore& s = result.score;
    fmt::print("{}; median timing error {}; {:.3g} times real time\n", strikes_text(s),
               s.true_contacts > s.missed ? fmt::format("{:.1f} ms", s.timing_median_ms)
                                          : "unknown (nothing matched)",
               (result.t_end_s - result.t0_s) / result.wall_s);
    print_if_apart(result);
    print_if_loud(result, true);
    print_left_out(result);
    print_lost(result);
    print_places(result);
    throw_if_any(result.failures, options.out);
}

void play_in_time(const RealtimeOptions& options) {
    const RealtimeOutcome outcome = play_realtime_and_warn(options);
    fmt::print("{:.1f} s in real time: {}; {} of {} missed, {} of {} late\n", outcome.realtime.seconds,
               strikes_text(outcome.play.score), outcome.latency.frames.missed,
               counted(outcome.latency.frames.total, "frame"), outcome.latency.notes.missed,
               counted(outcome.latency.notes.total, "note"));
    print_if_apart(outcome.play);
    print_if_loud(outcome.play, false);
    print_left_out(outcome.play);
    print_lost(outcome.play);
    if (const OfflineComparison& offline = outcome.offline; offline.offline_strikes > 0)
        fmt::print("{} offline: {} here, {} unexplained ({})\n", counted(offline.offline_strikes, "strike"),
                   counted(offline.departures.size(), "departure"), offline.unexplained(),
                   (options.play.out / "departures.csv").string());
    print_places(outcome.play);
    if (!outcome.failure.empty()) throw std::runtime_error(outcome.failure);
    throw_if_any(outcome.play.failures, options.play.out);
}

void check_video(const PlayOptions& o) {
    if (!o.video) return;
    if (o.width % 2 != 0 || o.height % 2 != 0)
        refuse_options(fmt::format("--video with --size {}x{}", o.width, o.height), "even sides");
    const OutputFile can_be(*o.video);
}

using Output = audio::LiveOptions::Output;

/// The device, and its name where it is ALSA's.
std::pair<Output, std::string> parse_output(const std::string& text) {
    if (text == "null") return {Output::none, ""};
    if (text == "jack") return {Output::jack, ""};
    if (text == "alsa") return {Output::alsa, "default"};
    if (text == "pipewire") return {Output::alsa, "pipewire"};
    if (text.starts_with("alsa:") && text.size() > 5) return {Output::alsa, text.substr(5)};
    throw BadInput(
        fmt::format("error: found `{}`, expected null, jack, alsa, alsa:DEVICE or pipewire", one_line(text)));
}

}  // namespace

RealtimeOutcome play_realtime_and_warn(const RealtimeOptions& options) {
    return play_realtime(options, [](const std::string& line) { tell(line); });
}

CLI::Option* add_play_options(Command& command, PlayOptions& o) {
    o.trace = "flourish", o.kit = "drums", o.progress = true;
    CLI::Option* trace = command.option("TRACE", o.trace, as::text("TRACE"),
                                        "Trace (CSV, Beat Saber replay, or the name of a bundled one)");
    command.option("--kit", o.kit, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    command.option("--fps", o.fps, as::number(1, 1000, "frames per second"), "Frame rate");
    command.option<Eigen::Vector2i>(
        "--size", as::pixels(16, 8192), "Size of the frames",
        [&o](const Eigen::Vector2i& size) { o.width = size.x(), o.height = size.y(); }, "640x480");
    command.option(
        "--camera", o.camera, camera_format(),
        "Where pictures are seen from; default: the kit's camera, else all of it from the drummer's side");
    const auto predictor = as::text("PREDICTOR", check_specification);
    CLI::Option* both = command.option<std::string>(
        "--predictor", predictor, "Predictor of pictures and sound",
        [&o](const std::string& name) { o.picture_predictor = o.sound_predictor = name; }, "auto");
    command.option("--picture-predictor", o.picture_predictor, predictor, "Predictor of pictures")
        ->excludes(both);
    command.option("--sound-predictor", o.sound_predictor, predictor, "Predictor of sound")->excludes(both);
    command.option("--render-lead", o.render_lead_s, as::number(0, 1, "s"), "Lead of pictures");
    command.option("--sound-lead", o.sound_lead_s, as::number(0.001, 1, "s"), "Lead of sound");
    command.option("--release-margin", o.release_margin_s, as::number(0, 1, "s"),
                   "A note is fixed this long before its onset, at most the sound lead");
    command.option("--false-cost", o.false_cost, as::number(0.01, 100),
                   "What a false sound costs where a missed strike costs 1");
    command.option("--workers", o.workers, as::whole(0, 64), "Worker processes of the simulation");
    command.option("--tip", o.tip, as::vector_of_3(as::number(-1000, 1000, "m")),
                   "Tip in the tracked body's frame");
    command.option("--shaft", o.shaft, as::axis(), "Body axis from hand to tip");
    command.option<std::string>(
        "--pedals", as::text("FILE"),
        "What feet and hands play beside the sticks: CSV `t,pedal,value` or a Standard MIDI "
        "File",
        [&o](const std::string& file) { o.pedals = file; });
    command.flag("--no-cancel", o.cancelling, "Play every scheduled note, also those of feints", false);
    command.flag("--no-audio", o.audio, "Sound nothing", false);
    command.checks([&o] {
        if (o.release_margin_s > o.sound_lead_s)
            refuse_options(fmt::format("--release-margin {}", o.release_margin_s),
                           fmt::format("at most the sound lead, {:.4g} s", o.sound_lead_s));
        o.trace = find_trace(o.trace);
        o.kit = find_kit(o.kit);
    });
    return trace;
}

std::vector<CLI::Option*> add_realtime_options(Command& command, RealtimeOptions& o, CLI::Option* trace) {
    const auto midi_out = [&o](const std::string& port) {
        const bool elsewhere = port.find(':') != std::string::npos;
        o.sound.midi_port = elsewhere ? "midi_out" : port;
        if (elsewhere) o.sound.midi_connect = port;
    };
    const auto disturb = [&o](const std::string& text) { o.disturbance = parse_artificial_load(text); };
    return {
        command.option("--seconds", o.seconds, as::number(0, 10800, "s"),
                       "How long; a shorter trace is played again and again; 0: the trace once"),
        command
            .option("--source", o.sensors.source, as::text("SOURCE"),
                    "Sensors instead of TRACE: stdin, zmq:ENDPOINT, osc:PORT (this machine) or "
                    "osc:*:PORT (any), trace:FILE")
            ->excludes(trace),
        command.option("--sticks", o.sensors.sticks, as::list_of(as::text("NAME")),
                       "Names of the sticks of --source"),
        command.option("--lead", o.lead_auto, as::choice<bool>({{"fixed", false}, {"auto", true}}),
                       "auto: leads follow the measured delays, never below those asked for"),
        command.option(
            "--output-lead", o.sound.output_lead_s, as::number(0.001, 1, "s"),
            "A block of sound is computed this long before it is due, less than the release margin"),
        command.option("--priority", o.realtime_priority,
                       as::choice<bool>({{"auto", true}, {"normal", false}}),
                       "auto: real-time scheduling where permitted; normal: never"),
        command.option<std::string>(
            "--output", as::text("DEVICE", [](const std::string& text) { parse_output(text); }),
            "What plays the sound: null (nothing), jack (a running server), alsa, alsa:DEVICE "
            "or pipewire (by its ALSA plugin)",
            [&o](const std::string& text) {
                std::tie(o.sound.output, o.sound.alsa_device) = parse_output(text);
            },
            "null"),
        command.option(
            "--midi-in", o.sound.midi_input, as::text("PORT"),
            "Listen to this JACK MIDI port (client:port) for pedals and chokes; a name without colon is a "
            "port of ours, left open"),
        command.option<std::string>("--midi-out", as::text("PORT"),
                                    "Send each note to this JACK MIDI port (client:port); a name without "
                                    "colon is a port of ours, left "
                                    "open",
                                    midi_out),
        command.option<std::string>(
            "--disturb", as::text("LOAD,..."),
            "Artificial load: load:N@A-B (threads), renderer:MS@A-B, stall:MS@A (from second A to B)",
            disturb)};
}

/// "6/8".
std::pair<int, int> parse_time_signature(const std::string& text) {
    int beats = 0, unit = 0;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%2d/%2d%c", &beats, &unit, &rest) != 2 || beats < 1 || beats > 64 ||
        unit < 1 || unit > 32 || (unit & (unit - 1)) != 0)
        throw BadInput(
            fmt::format("error: found `{}`, expected BEATS/UNIT, 1 to 64 beats, each a 1, 2, 4, 8, "
                        "16 or 32: 3/4",
                        text));
    return {beats, unit};
}

void add_mix_options(Command& command, MixOptions& o, CLI::Option* realtime) {
    CLI::Option* gain = command.option("--gain", o.gain_db, as::number(-60, 60, "dB"),
                                       "Gain of the whole kit instead of its own, and no loudness to reach");
    command
        .option("--loudness", o.loudness_lufs, as::number(-60, 0, "LUFS"),
                "Integrated loudness of audio.wav (EBU R 128), as far as a true peak of -1 dBTP allows")
        ->excludes(gain)
        ->excludes(realtime);
    command.flag("--bus-stems", o.bus_stems, "Also a WAV file each [[bus]] of the kit, in stems/");
    command.flag("--stems", o.stems, "Also a WAV file each instrument, in stems/, without the room");
    command.option("--tempo", o.midi.tempo_bpm, as::number(20, 400, "quarters per minute"),
                   "Tempo of hits.mid");
    command.option<std::string>(
        "--time-signature", as::text("N/D", [](const std::string& text) { parse_time_signature(text); }),
        "Time signature of hits.mid",
        [&o](const std::string& text) {
            std::tie(o.midi.beats, o.midi.beat_unit) = parse_time_signature(text);
        },
        "4/4");
}

void add_play_command(Command& program) {
    Command command = program.command("play", "Play a recorded trace into pictures and sound");
    struct Options : RealtimeOptions {
        bool realtime = false;
    };
    auto o = std::make_shared<Options>();
    CLI::Option* trace = add_play_options(command, o->play);
    command.option("--out", o->play.out, as::text("DIR"), "Folder for the products");
    command.option("--save-model", o->play.save_model, as::text("FILE"),
                   "File for the network of the pictures' predictor as the sticks have taught it");
    CLI::Option* solo =
        command.option("--solo", o->play.solo, as::whole(0, std::numeric_limits<std::int64_t>::max()),
                       "Render the sound of one note alone, by its id in events.csv");
    CLI::Option* no_frames = command.flag("--no-frames", o->play.frames, "Draw nothing", false);
    CLI::Option* video = command.option("--video", o->play.video, as::text("FILE", check_video_name),
                                        "Make a video (MP4) of frames and sound, in place of the frames");
    video->excludes(no_frames);
    command.flag("--keep-frames", o->play.keep_frames, "Keep the frames beside the video, too")->needs(video);
    CLI::Option* show = command.option<std::vector<std::string>>(
        "--show", as::list_of(as::choice({"ghosts", "marks"})),
        "Also draw ghosts of the sticks (measured, predicted, true) and marks of strikes",
        [shown = &o->play.shown](const std::vector<std::string>& what) {
            shown->ghosts = std::ranges::count(what, "ghosts") > 0;
            shown->marks = std::ranges::count(what, "marks") > 0;
        });
    show->excludes(no_frames);
    CLI::Option* blur = command.option(
        "--motion-blur", o->play.shutter, as::number(0, 1, "of the time between frames"),
        "The shutter is open for this share of the time between frames, up to the frame's; 0: no blur");
    blur->excludes(no_frames);
    CLI::Option* realtime = command.flag("--realtime", o->realtime,
                                         "Play against the wall clock, sensors in processes of their own");
    realtime->excludes(solo)->excludes(show)->excludes(blur);
    add_mix_options(command, o->play.mix, realtime);
    for (CLI::Option* option : add_realtime_options(command, *o, trace)) option->needs(realtime);
    command.checks([o] {
        check_video(o->play);
        if (!o->play.save_model) return;
        const std::filesystem::path inputs[] = {find_trace(o->play.trace)};
        refuse_replacing(*o->play.save_model, inputs);
    });
    command.runs([o] { o->realtime ? play_in_time(*o) : play_offline(o->play); });
}

}  // namespace app
