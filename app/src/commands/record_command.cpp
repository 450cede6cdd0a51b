#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "process/clock.h"
#include "sensors/record.h"

namespace app {
namespace {

void print_clock(const RecordedStick& stick, const std::string& out) {
    const ClockEstimate& clock = stick.clock.estimate;
    fmt::print("{}: {}: times: {}; offset {:.6f} s, drift {:.1f} ppm, delay p95 {:.2f} ms, {}\n", out,
               stick.name, name_of(stick.clock.clock), clock.offset_s, clock.drift_ppm,
               clock.delay_p95_s * 1e3, counted(clock.jumps, "jump"));
    if (stick.apart_s != 0)
        fmt::print("{}: {}: its clock is {:.3f} s from the first stick's; its times are put on that one's\n",
                   out, stick.name, std::abs(stick.apart_s));
    if (stick.clock.wall && std::abs(stick.clock.ahead_s) > kFarFromWallS)
        fmt::print("{}: {}: its clock is {:.3f} s {} this machine's\n", out, stick.name,
                   std::abs(stick.clock.ahead_s), stick.clock.ahead_s > 0 ? "ahead of" : "behind");
}

void print(const RecordResult& result, const std::string& out) {
    for (const RecordedStick& stick : result.sticks)
        fmt::print("{}: {}: {} in {:.3f} s, {:.2f} per second, {}{}\n", out, stick.name,
                   counted(stick.samples, "sample"), stick.last_s - stick.first_s,
                   static_cast<double>(stick.samples - 1) / (stick.last_s - stick.first_s),
                   counted(stick.gaps, "gap"),
                   stick.gaps == 0 ? "" : fmt::format(", the longest {:.3f} s", stick.longest_gap_s));
    for (const std::string& name : result.alone) fmt::print("{}: {}: one sample, left out\n", out, name);
    for (const RecordedStick& stick : result.sticks) print_clock(stick, out);
    if (result.late > 0)
        fmt::print("{}: {} late or repeated, left out\n", out, counted(result.late, "sample"));
    if (result.faults.foreign > 0)
        fmt::print("{}: {} of other sticks\n", out, counted(result.faults.foreign, "sample"));
    if (result.faults.lost > 0)
        fmt::print("{}: {} lost for lack of time\n", out, counted(result.faults.lost, "sample"));
    if (result.faults.malformed > 0)
        fmt::print("{}: {} left out, the first: {}\n", out, counted(result.faults.malformed, "message"),
                   result.faults.first);
}

}  // namespace

void add_record_command(Command& program) {
    Command command = program.command("record", "Write what a source of samples gives to a trace");
    auto o = std::make_shared<RecordOptions>();
    command.required("--source", o->source.source, as::text("SOURCE"),
                     "trace:FILE, stdin, zmq:ENDPOINT, osc:PORT (this machine) or osc:*:PORT (any)");
    command.required("--out", o->out, as::text("FILE"), "Trace to write (CSV); replaced if there is one");
    command.option("--seconds", o->seconds, as::number(0, as::kAny, "s"),
                   "From the first sample on; 0: until the source ends, Ctrl-C or SIGTERM");
    command.option("--sticks", o->source.sticks, as::list_of(as::text("NAME")),
                   "Names; default: all that come");
    command.option("--speed", o->source.speed, as::number_above(0, as::kAny), "Of a replay, for tests")
        ->group("");
    command.runs([o] {
        if (constexpr std::string_view kTrace = "trace:"; o->source.source.starts_with(kTrace)) {
            const std::filesystem::path inputs[] = {find_trace(o->source.source.substr(kTrace.size()))};
            refuse_replacing(o->out, inputs);
        }
        o->source.epoch_ns = monotonic_ns() + kHeadStartNs;
        print(record(*o), o->out.string());
    });
}

}  // namespace app
