#include "commands/trace_commands.h"

#include <fmt/format.h>
#include <tracking/trace.h>

#include <memory>

#include "commands/trace_convert.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/finished_file.h"
#include "files/option_values.h"
#include "kit/drum_score.h"
#include "kit/kit.h"
#include "traces/trace_info.h"
#include "traces/trace_warnings.h"

namespace app {
namespace {

struct SynthArguments {
    std::string name, kit = "drums", rate = "120", noise = "0.25", out;
    std::uint64_t seed = 1;
};

void synthesise_file(const SynthArguments& a) {
    SyntheticSensor sensor;
    sensor.rate_hz = parse_number(a.rate, "--rate");
    sensor.noise_mm = parse_number(a.noise, "--noise");
    sensor.seed = a.seed;
    if (!(sensor.rate_hz >= 10 && sensor.rate_hz <= 2000))
        throw BadInput(fmt::format("error: found --rate {}, expected 10 to 2000 Hz", a.rate));
    if (!(sensor.noise_mm >= 0 && sensor.noise_mm <= 50))
        throw BadInput(fmt::format("error: found --noise {}, expected 0 to 50 mm", a.noise));
    const Kit kit = read_kit(find_kit(a.kit));
    write_finished_file(a.out, tracking::format_trace(synthesise_score(a.name, kit, sensor)));
}

void add_synth(CLI::App& trace) {
    CLI::App* command = trace.add_subcommand("synth", "Make a synthetic trace of a score, played on a kit");
    auto a = std::make_shared<SynthArguments>();
    command->add_option("NAME", a->name, "Score")->required()->check(CLI::IsMember(score_names()));
    command->add_option("--kit", a->kit, "Kit: a file, or the name of a bundled one")->capture_default_str();
    command->add_option("--seed", a->seed, "Seed of the sensor's noise")->capture_default_str();
    command->add_option("--rate", a->rate, "Samples a second")->capture_default_str();
    command->add_option("--noise", a->noise, "Standard deviation of position noise [mm]")
        ->capture_default_str();
    command->add_option("--out", a->out, "Trace to write (CSV); replaced if there is one")->required();
    command->callback([a] { synthesise_file(*a); });
}

void add_info(CLI::App& trace) {
    CLI::App* command = trace.add_subcommand("info", "Tell what a trace holds");
    auto file = std::make_shared<std::string>();
    auto json = std::make_shared<bool>(false);
    command->add_option("TRACE", *file, "Trace (CSV, Beat Saber replay, or the name of a bundled one)")
        ->required();
    command->add_flag("--json", *json, "As one JSON document");
    command->callback([file, json] {
        const tracking::Trace trace_read = tracking::read_trace(find_trace(*file));
        const std::vector<StickInfo> sticks = trace_info(trace_read);
        if (!*json) warn_of_implausible(trace_read);
        fmt::print("{}", *json ? format_info_json(trace_read, sticks) : format_info(trace_read, sticks));
    });
}

void add_check(CLI::App& trace) {
    CLI::App* command = trace.add_subcommand("check", "Check traces; the first fault ends it");
    auto files = std::make_shared<std::vector<std::string>>();
    command->add_option("TRACE", *files, "Traces (CSV, Beat Saber replays, or names of bundled ones)")
        ->required();
    command->callback([files] {
        for (const std::string& file : *files) {
            const tracking::Trace checked = tracking::read_trace(find_trace(file));
            std::size_t samples = 0;
            for (const tracking::StickTrace& stick : checked.sticks) samples += stick.samples.size();
            warn_of_implausible(checked);
            fmt::print("{}: in order, {} sticks, {} samples\n", file, checked.sticks.size(), samples);
        }
    });
}

}  // namespace

void add_trace_command(CLI::App& program) {
    CLI::App* trace = program.add_subcommand("trace", "Look at, check, convert or make traces");
    trace->require_subcommand(1);
    add_info(*trace);
    add_check(*trace);
    add_synth(*trace);
    add_convert_command(*trace);
}

}  // namespace app
