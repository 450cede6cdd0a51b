#include "commands/realtime_arguments.h"

#include <fmt/format.h>

#include <set>

#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/option_values.h"

namespace app {
namespace {

void one_of(const std::string& option, const std::string& value, const std::string& first,
            const std::string& second) {
    if (value != first && value != second)
        throw BadInput(fmt::format("error: found {} {}, expected {} or {}", option, value, first, second));
}

}  // namespace

std::vector<CLI::Option*> add_realtime_options(CLI::App& command, RealtimeArguments& a) {
    return {
        command.add_option("--seconds", a.seconds,
                           "How long; a shorter trace is played again and again (default, and 0: once)"),
        command.add_option("--source", a.source,
                           "Sensors instead of TRACE: stdin, zmq:ENDPOINT, osc:PORT, trace:FILE"),
        command.add_option("--sticks", a.sticks, "Names of the sticks of --source")->capture_default_str(),
        command
            .add_option("--lead", a.lead,
                        "fixed, or auto: leads follow the measured delays, never below those asked for")
            ->capture_default_str(),
        command
            .add_option("--output-lead", a.output_lead,
                        "A block of sound is computed this long before it is due [s]")
            ->capture_default_str(),
        command
            .add_option("--priority", a.priority, "auto: real-time scheduling where permitted; normal: never")
            ->capture_default_str(),
        command.add_flag("--jack", a.jack, "Also play through a running JACK server"),
        command.add_option("--midi-out", a.midi_out,
                           "Send each note to this JACK MIDI port (client:port); a name without colon is a "
                           "port of ours, left open"),
        command.add_option("--disturb", a.disturb,
                           "Bear load:N@A-B (threads), renderer:MS@A-B, stall:MS@A, separated by commas")};
}

RealtimeOptions realtime_options(const PlayOptions& play, const RealtimeArguments& a) {
    RealtimeOptions o;
    o.play = play;
    o.source = a.source;
    o.sticks = split_at_commas(a.sticks);
    const std::set<std::string> names(o.sticks.begin(), o.sticks.end());
    if (names.size() != o.sticks.size() || names.contains(""))
        throw BadInput(
            fmt::format("error: found --sticks {}, expected different names such as left,right", a.sticks));
    if (!a.seconds.empty()) o.seconds = parse_number(a.seconds, "--seconds");
    one_of("--lead", a.lead, "fixed", "auto");
    one_of("--priority", a.priority, "auto", "normal");
    o.lead_auto = a.lead == "auto";
    o.output_lead_s = parse_number(a.output_lead, "--output-lead");
    o.realtime_priority = a.priority == "auto";
    o.jack_audio = a.jack;
    if (!a.midi_out.empty()) {
        const bool elsewhere = a.midi_out.find(':') != std::string::npos;
        o.midi_port = elsewhere ? "midi_out" : a.midi_out;
        if (elsewhere) o.midi_connect = a.midi_out;
    }
    if (!a.disturb.empty()) o.disturbance = parse_disturbance(a.disturb);
    o.disturbed_by = a.disturb;
    return o;
}

}  // namespace app
