#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/worker_options.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "process/standard_streams.h"
#include "scene/scene.h"
#include "simulate/checkpoint.h"
#include "simulate/simulate.h"

namespace app {
namespace {

namespace fs = std::filesystem;

void print_workers(const SimulateResult& r) {
    const WorkerOptions& o = *r.worker_options;
    fmt::print("{}, bound {}: {:.1f} bytes per body and step, {} between workers, {} traded\n",
               counted(r.workers, o.simulated ? "simulated processor" : "worker"), o.bound,
               r.body_steps > 0 ? double(r.bytes) / double(r.body_steps) : 0.0,
               counted(r.cross_contacts, "contact"), counted(r.migrations, "body"));
    if (r.one_owner && r.workers > 1)
        fmt::print(
            "one worker stepped all bodies: they differ too much in mass or length to be shared out; "
            "--workers 0 --threads N shares out each step\n");
    if (r.lost + r.left > 0)
        fmt::print("{} lost, {} left early; {} went to others\n", counted(r.lost, "worker"), r.left,
                   counted(r.bodies_reowned, "body"));
}

void print(const SimulateResult& r, const SimulateOptions& options) {
    fmt::print(
        "{}: {} ({} rigid, {} linear, {} modal), {} of {:.6g} s in {:.3g} {}: {:.2f} us per body and step\n",
        r.name, counted(r.bodies, "body"), r.rigid, r.linear, r.modal, counted(r.steps, "step"), r.dt_s,
        r.elapsed_s, r.worker_options && r.worker_options->simulated ? "simulated s" : "s",
        r.body_steps > 0 ? 1e6 * r.elapsed_s / double(r.body_steps) : 0.0);
    fmt::print("energy {:.6g} J at first, {:.6g} J at last; ", r.energy_start.total(), r.energy.total());
    if (!r.worker_options) fmt::print("{} asleep; ", r.counts.asleep);
    fmt::print("state {:016x}\n", r.state_hash);
    if (r.worker_options) print_workers(r);
    if (r.accuracy)
        for (const std::string& line : r.accuracy->lines()) fmt::print("{}\n", line);
    for (const std::string& line : r.mishaps.lines()) fmt::print("{}\n", line);
    std::error_code none;
    if (options.out && (options.frames || options.video) && fs::exists(*options.out / "frames", none))
        fmt::print("See {}\n", (*options.out / "frames").string());
    if (options.video && r.failures.empty()) fmt::print("Watch {}\n", options.video->string());
}

void simulate_and_print(const SimulateOptions& options, bool json, bool allow_quarantine) {
    const SimulateResult result = simulate(options);
    for (const std::string& note : result.worker_options ? std::vector<std::string>{} : result.notes)
        tell(fmt::format("{}: note: {}", result.scene.string(), note));
    if (json)
        fmt::print("{}", format_simulate(result));
    else
        print(result, options);
    if (const auto taken_out = result.mishaps.quarantined.size(); taken_out > 0 && !allow_quarantine)
        throw std::runtime_error(fmt::format(
            "{}: error: found {} taken out, expected none; shorten the step (--dt), soften what drives them, "
            "or take it as it is (--allow-quarantine)",
            result.scene.string(), counted(taken_out, "body")));
    if (!options.until_rest || result.rest_reached)
        return throw_if_any(result.failures, options.out.value_or(""));
    const std::string awake =
        result.worker_options
            ? "bodies"
            : fmt::format("{} of {}", result.bodies - result.counts.asleep, counted(result.bodies, "body"));
    throw std::runtime_error(fmt::format(
        "{}: error: found {} awake after {} (or events to come), expected rest; {}", result.scene.string(),
        awake, counted(result.steps, "step"),
        result.worker_options
            ? "what bodies of several workers hold does not come to rest: use --workers 0 --threads N"
            : "allow more --steps, or damp what swings and spins (damping_alpha)"));
}

struct Options : SimulateOptions {
    bool json = false, allow_quarantine = false;
    std::optional<fs::path> resume;
};

std::shared_ptr<Options> declare_simulation(Command& command) {
    auto o = std::make_shared<Options>();
    o->progress = true;
    command.option("SCENE", o->scene, as::text("SCENE"), "Scene: a file, or the name of a bundled one");
    CLI::Option* steps = command.option("--steps", o->steps, as::whole(0, 1'000'000'000),
                                        "Steps to do; default: as long as the scene says");
    command
        .option("--seconds", o->seconds, as::number_above(0, 360000, "s"),
                "Instead of --steps, of the scene's time")
        ->excludes(steps);
    command.option("--dt", o->dt_s, as::number(1e-6, 0.1, "s"),
                   "Length of a step, such as 1/60; default: the scene's");
    command.option("--accuracy", o->accuracy, as::number(1e-4, 0.5),
                   "Error allowed against the continuum, share of each body's largest extent, such as 0.01; "
                   "default: the scene's, or all as it says. With --dt the step is kept");
    command.option("--until", o->until_rest, as::choice<bool>({{"rest", true}}),
                   "rest: until every body sleeps and no event is left, --steps (10 minutes) at most");
    command.option("--out", o->out, as::text("DIR"),
                   "Folder for states.csv, energy.csv, times.csv, summary.json; with workers timing.csv, "
                   "workers.svg");
    command.flag("--frames", o->frames, "Also draw frames/000000.png on");
    command.option("--fps", o->fps, as::number(0.1, 1000, "per second"), "Frames, and rows of states.csv");
    command.option<Eigen::Vector2i>(
        "--size", as::pixels(16, 8192), "Size of the frames",
        [o = o.get()](const Eigen::Vector2i& size) { o->width = size.x(), o->height = size.y(); }, "640x480");
    command.option(
        "--camera", o->camera, camera_format(),
        "Where pictures are seen from; default: the scene's camera, else all bodies from the drummer's side");
    CLI::Option* blur = command.option(
        "--motion-blur", o->shutter, as::number(0, 1, "of the time between frames"),
        "The shutter is open for this share of the time between frames, up to the frame's; 0: no blur");
    command.option("--video", o->video, as::text("FILE", check_video_name),
                   "Make a video (MP4); without --frames its frames are not kept");
    command
        .option("--checkpoint", o->checkpoint, as::whole(0, 1'000'000'000, "steps"),
                "Save after every so many steps, in --out, what --resume goes on from; 0: never")
        ->excludes(blur);
    command.option("--resume", o->resume, as::text("DIR"),
                   "Instead of SCENE: go on with the interrupted run in this folder, with its options");
    command.option(
        "--threads", o->threads, as::whole(1, kMostThreads),
        "Threads that share out each step; default: one a processor core, 8 at most. With --workers those of "
        "each that is started here, see `worker`; default 1. No bit of one process depends on how many");
    add_worker_options(command, o->workers);
    command.flag(
        "--allow-quarantine", o->allow_quarantine,
        "Exit status 0 also if bodies left the world's range or became not finite and were taken out");
    command.flag("--json", o->json, "Print one JSON document instead of words");
    return o;
}

/// Of a run that goes on: how it is done and shown may be another than it was, what comes out may not.
bool may_change(const std::string& name) {
    constexpr std::array<std::string_view, 4> kHow = {"--checkpoint", "--threads", "--json",
                                                      "--allow-quarantine"};
    return std::ranges::count(kHow, name) > 0;
}

std::string name_of(const std::string& word) {
    return word.substr(0, word.find('='));
}

/// The words of the command that began a run, and of those `given` now what may change.
std::vector<std::string> words_of(const Checkpoint& saved, const std::vector<std::string>& given,
                                  const fs::path& file) {
    std::vector<std::string> words = saved.words;
    for (const std::string& word : given) {
        if (may_change(name_of(word))) {
            std::erase_if(words, [&](const std::string& old) { return name_of(old) == name_of(word); });
            words.push_back(word);
        } else if (std::ranges::count(words, word) == 0) {
            throw BadInput(fmt::format(
                "{}: error: found {} for a run that began with {}, expected the same or nothing",
                file.string(), one_line(word), one_line(fmt::format("{}", fmt::join(saved.words, " ")))));
        }
    }
    return words;
}

/// The options of the interrupted run in `given.resume`. Names of files begin in its folder from here on.
Options resumed(const Options& given, const Command& command) {
    const fs::path out = fs::absolute(*given.resume), file = checkpoint_file(*given.resume);
    std::error_code error;
    if (given.out && !fs::equivalent(*given.out, out, error))
        refuse_options("--out " + given.out->string() + " with --resume " + given.resume->string(),
                       "the same folder, or no --out");
    const Checkpoint saved = read_checkpoint(file);
    const std::vector<std::string> words = words_of(saved, command.given_but({"--resume", "--out"}), file);
    fs::current_path(saved.directory, error);
    if (error)
        throw BadInput(fmt::format("{}: error: found {}, expected the folder in which the run began",
                                   saved.directory.string(), error.message()));
    CLI::App line("", "simulate");
    Command again(line);
    const std::shared_ptr<Options> o = declare_simulation(again);
    again.runs([] {});
    try {
        line.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::ParseError& wrong) {
        throw BadInput(fmt::format("{}: error: found {}, expected options of simulate; begin the run anew",
                                   file.string(), one_line(wrong.what())));
    }
    o->words = words;
    o->out = out;
    o->goes_on = true;
    return *o;
}

}  // namespace

void add_simulate_command(Command& program) {
    Command command = program.command("simulate", "Let the bodies of a scene fall, touch and bend");
    const std::shared_ptr<Options> o = declare_simulation(command);
    command.runs([o, command] {
        if (o->scene.empty() && !o->resume)
            refuse_options("no SCENE", "one, or --resume DIR; see `musicworld simulate --help`");
        o->words = command.given_but({"--resume", "--out"});
        Options options = o->resume ? resumed(*o, command) : *o;
        options.scene = find_scene(options.scene);
        simulate_and_print(options, options.json, options.allow_quarantine);
    });
}

}  // namespace app
