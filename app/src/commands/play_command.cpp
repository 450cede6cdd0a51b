#include "commands/play_command.h"

#include <fmt/format.h>

#include <memory>

#include "commands/play_arguments.h"
#include "commands/realtime_arguments.h"
#include "files/bad_input.h"
#include "play/play.h"
#include "realtime/play_realtime.h"
#include "statistics/statistics.h"
#include "strikes/strike_score.h"

namespace app {
namespace {

/// The options as typed.
struct Typed {
    PlayArguments play;
    RealtimeArguments in_time;
    std::string video;
    std::int64_t solo = -1;  // none
    bool realtime = false;
};

PlayOptions options_of(const Typed& typed) {
    PlayOptions options = play_options(typed.play);
    if (typed.solo >= 0) options.solo = static_cast<std::uint64_t>(typed.solo);
    if (!typed.video.empty()) options.video = typed.video;
    return options;
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
    const auto unexplained = std::ranges::count_if(
        outcome.departures, [](const Divergence& d) { return d.cause == "unexplained"; });
    fmt::print(
        "{:.1f} s in real time: {} strikes of {} sounded, {} false, {} cancelled; {} of {} frames missed, {} "
        "of {} notes late\n",
        r.seconds, s.true_contacts - s.missed, s.true_contacts, s.false_notes, s.cancelled,
        outcome.latency.frames.missed, outcome.latency.frames.total, outcome.latency.notes.missed,
        outcome.latency.notes.total);
    if (outcome.offline_strikes > 0)
        fmt::print("{} strikes offline: {} depart from them here, {} unexplained ({})\n",
                   outcome.offline_strikes, outcome.departures.size(), unexplained,
                   (options.play.out / "departures.csv").string());
    print_places(options.play);
    if (!outcome.failure.empty()) throw std::runtime_error(outcome.failure);
}

}  // namespace

void add_play_command(CLI::App& program) {
    CLI::App* play_command = program.add_subcommand("play", "Play a recorded trace into pictures and sound");
    auto a = std::make_shared<Typed>();
    a->play.out = "out";
    add_play_options(*play_command, a->play);
    play_command->add_option("--out", a->play.out, "Folder for the products")->capture_default_str();
    play_command->add_option("--solo", a->solo,
                             "Render the sound of one note alone, by its id in events.csv");
    play_command->add_option("--video", a->video, "Also make a video (MP4) of frames and sound");
    CLI::Option* realtime = play_command->add_flag(
        "--realtime", a->realtime, "Play against the wall clock, sensors in processes of their own");
    for (CLI::Option* option : add_realtime_options(*play_command, a->in_time)) option->needs(realtime);
    play_command->callback([a] {
        const PlayOptions options = options_of(*a);
        if (a->realtime) {
            if (!a->in_time.source.empty() && !a->play.trace.empty())
                throw BadInput(fmt::format("error: found TRACE {} and --source {}, expected one of them",
                                           a->play.trace, a->in_time.source));
            play_in_time(realtime_options(options, a->in_time));
            return;
        }
        print_result(play(options), options);
    });
}

}  // namespace app
