#include "commands/record_command.h"

#include <fmt/format.h>

#include <memory>

#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/option_values.h"
#include "process/clock.h"
#include "sensors/record.h"

namespace app {
namespace {

constexpr std::int64_t kHeadStartNs = 20'000'000;  // so that the first sample of a replay is in time

struct RecordArguments {
    std::string source, out, seconds = "0", sticks, speed = "1";
};

void print(const RecordResult& result, const std::string& out) {
    for (const RecordedStick& stick : result.sticks)
        fmt::print("{}: {}: {} samples in {:.3f} s, {:.2f} a second, {} gaps{}\n", out, stick.name,
                   stick.samples, stick.last_s - stick.first_s,
                   static_cast<double>(stick.samples - 1) / (stick.last_s - stick.first_s), stick.gaps,
                   stick.gaps == 0 ? "" : fmt::format(", the longest {:.3f} s", stick.longest_gap_s));
    for (const std::string& name : result.alone) fmt::print("{}: {}: one sample, left out\n", out, name);
    fmt::print("{}: times: {}; offset {:.6f} s, drift {:.1f} ppm, delay p95 {:.2f} ms, {} jumps\n", out,
               result.clock, result.estimate.offset_s, result.estimate.drift_ppm,
               result.estimate.delay_p95_s * 1e3, result.estimate.jumps);
    if (result.late > 0) fmt::print("{}: {} samples late or repeated, left out\n", out, result.late);
    if (result.faults.foreign > 0) fmt::print("{}: {} samples of other sticks\n", out, result.faults.foreign);
    if (result.faults.lost > 0) fmt::print("{}: {} samples lost for lack of time\n", out, result.faults.lost);
    if (result.faults.malformed > 0)
        fmt::print("{}: {} messages left out, the first: {}\n", out, result.faults.malformed,
                   result.faults.first);
}

void run(const RecordArguments& a) {
    RecordOptions options;
    options.source.source = a.source;
    options.source.speed = parse_number(a.speed, "--speed");
    options.source.epoch_ns = monotonic_ns() + kHeadStartNs;
    if (!a.sticks.empty()) options.source.sticks = split_at_commas(a.sticks);
    options.out = a.out;
    options.seconds = parse_number(a.seconds, "--seconds");
    if (!(options.seconds >= 0))
        throw BadInput(
            fmt::format("error: found --seconds {}, expected 0 (until the end) or more", a.seconds));
    if (!(options.source.speed > 0))
        throw BadInput(fmt::format("error: found --speed {}, expected more than 0", a.speed));
    print(record(options), a.out);
}

}  // namespace

void add_record_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand("record", "Write what a source of samples gives to a trace");
    auto a = std::make_shared<RecordArguments>();
    command->add_option("--source", a->source, "trace:FILE, stdin, zmq:ENDPOINT or osc:PORT")->required();
    command->add_option("--out", a->out, "Trace to write (CSV); replaced if there is one")->required();
    command
        ->add_option("--seconds", a->seconds,
                     "From the first sample on; 0: until the source ends, Ctrl-C or SIGTERM")
        ->capture_default_str();
    command->add_option("--sticks", a->sticks, "Names; default: all that come");
    command->add_option("--speed", a->speed, "Of a replay, for tests")->group("");
    command->callback([a] { run(*a); });
}

}  // namespace app
