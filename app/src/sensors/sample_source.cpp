#include "sensors/sample_source.h"

#include <fmt/format.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "sensors/osc_source.h"
#include "sensors/stream_source.h"
#include "sensors/trace_source.h"
#include "sensors/zmq_source.h"

namespace app {
namespace {

constexpr std::string_view kTrace = "trace:", kStream = "stdin", kZmq = "zmq:", kOsc = "osc:";

[[noreturn]] void refuse(const std::string& source) {
    throw BadInput(fmt::format(
        "error: found source \"{}\", expected trace:FILE, stdin, zmq:ENDPOINT or osc:PORT", source));
}

}  // namespace

bool serves_all_sticks(const std::string& source) {
    return !source.starts_with(kTrace);
}

void check_source(const SourceOptions& options) {
    if (options.source.starts_with(kOsc))
        check_osc_port(options.source.substr(kOsc.size()));
    else if (options.source != kStream)
        (void)open_source(options);
    if (options.sticks.size() > StickNames::kMostSticks)
        throw BadInput(fmt::format("error: found {} sticks, expected at most {}", options.sticks.size(),
                                   StickNames::kMostSticks));
}

std::unique_ptr<SampleSource> open_source(const SourceOptions& options) {
    const std::string& source = options.source;
    if (source.starts_with(kTrace))
        return std::make_unique<TraceSource>(source.substr(kTrace.size()), options);
    if (source == kStream) return std::make_unique<StreamSource>(STDIN_FILENO, options);
    if (source.starts_with(kZmq)) return std::make_unique<ZmqSource>(source.substr(kZmq.size()), options);
    if (source.starts_with(kOsc)) return std::make_unique<OscSource>(source.substr(kOsc.size()), options);
    refuse(source);
}

}  // namespace app
