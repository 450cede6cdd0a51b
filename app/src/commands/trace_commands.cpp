#include <fmt/format.h>
#include <tracking/trace.h>

#include <limits>
#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "kit/drum_score.h"
#include "kit/kit.h"
#include "sticks/trace_warnings.h"
#include "traces/trace_info.h"

namespace app {
namespace {

struct SynthOptions {
    std::string score, kit = "drums", out;
    SyntheticSensor sensor;
};

void add_synth(Command& trace) {
    Command command = trace.command("synth", "Make a synthetic trace of a score, played on a kit");
    auto o = std::make_shared<SynthOptions>();
    command.required("NAME", o->score, as::choice(score_names()), "Score: " + one_of(score_names()));
    command.option("--kit", o->kit, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    command.option("--seed", o->sensor.seed, as::whole(0, std::numeric_limits<std::int64_t>::max()),
                   "Seed of the sensor's noise");
    command.option("--rate", o->sensor.rate_hz, as::number(10, 2000, "Hz"), "Samples per second");
    command.option("--noise", o->sensor.noise_mm, as::number(0, 50, "mm"),
                   "Standard deviation of position noise");
    command.required("--out", o->out, as::text("FILE"), "Trace to write (CSV); replaced if there is one");
    command.runs([o] {
        const Kit kit = read_kit(find_kit(o->kit));
        write_finished_file(o->out, tracking::format_trace(synthesise_score(o->score, kit, o->sensor)));
    });
}

void add_info(Command& trace) {
    Command command = trace.command("info", "Tell what a trace holds");
    auto file = std::make_shared<std::string>();
    auto json = std::make_shared<bool>(false);
    command.required("TRACE", *file, as::text("TRACE"),
                     "Trace (CSV, Beat Saber replay, or the name of a bundled one)");
    command.flag("--json", *json, "As one JSON document");
    command.runs([file, json] {
        const tracking::Trace trace_read = tracking::read_trace(find_trace(*file));
        if (!*json) warn_of_implausible(trace_read);
        fmt::print("{}", *json ? format_info_json(trace_read) : format_info(trace_read));
    });
}

void add_trace_check(Command& trace) {
    Command command = trace.command("check", "Check traces; the first fault ends it");
    auto files = std::make_shared<std::vector<std::string>>();
    command
        .options("TRACE", *files, as::text("TRACE"),
                 "Traces (CSV, Beat Saber replays, or names of bundled ones)")
        ->required();
    command.runs([files] {
        for (const std::string& file : *files) {
            const tracking::Trace checked = tracking::read_trace(find_trace(file));
            std::size_t samples = 0;
            for (const tracking::StickTrace& stick : checked.sticks) samples += stick.samples.size();
            warn_of_implausible(checked);
            fmt::print("{}: in order, {}, {}\n", file, counted(checked.sticks.size(), "stick"),
                       counted(samples, "sample"));
        }
    });
}

}  // namespace

void add_trace_command(Command& program) {
    Command trace = program.command("trace", "Look at, check, convert or make traces");
    add_info(trace);
    add_trace_check(trace);
    add_synth(trace);
    add_convert_command(trace);
}

}  // namespace app
