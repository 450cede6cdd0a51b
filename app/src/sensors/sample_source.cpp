#include "sensors/sample_source.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "files/bad_input.h"
#include "sensors/osc_source.h"
#include "sensors/row_sources.h"
#include "sensors/trace_source.h"

namespace app {
namespace {

constexpr std::string_view kTrace = "trace:", kStream = "stdin", kZmq = "zmq:", kOsc = "osc:";

bool is_word(std::string_view name) {
    return !name.empty() && name.size() <= StickNames::kLongestName &&
           std::all_of(name.begin(), name.end(),
                       [](char c) { return c > ' ' && c < 0x7f && c != ',' && c != '"' && c != '\''; });
}

}  // namespace

std::optional<std::size_t> StickNames::index_of(std::string_view name) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
    if (!open_ || names_.size() == kMostSticks || !is_word(name)) return std::nullopt;
    names_.emplace_back(name);
    return names_.size() - 1;
}

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
    if (source == kStream) return make_stream_source(STDIN_FILENO, options);
    if (source.starts_with(kZmq)) return make_zmq_source(source.substr(kZmq.size()), options);
    if (source.starts_with(kOsc)) return std::make_unique<OscSource>(source.substr(kOsc.size()), options);
    throw BadInput(fmt::format(
        "error: found source \"{}\", expected trace:FILE, stdin, zmq:ENDPOINT or osc:PORT", source));
}

}  // namespace app
