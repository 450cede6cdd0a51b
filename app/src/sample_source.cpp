#include "sample_source.h"

#include <fmt/format.h>

#include "bad_input.h"
#include "trace_source.h"

namespace app {
namespace {

constexpr std::string_view kTrace = "trace:";

[[noreturn]] void refuse(const std::string& source) {
    throw BadInput(fmt::format(
        "error: found source \"{}\", expected trace:FILE, stdin, zmq:ENDPOINT or osc:PORT", source));
}

}  // namespace

bool serves_all_sticks(const std::string& source) {
    return !source.starts_with(kTrace);
}

void check_source(const SourceOptions& options) {
    if (options.source.starts_with(kTrace))
        (void)open_source(options);
    else
        refuse(options.source);
}

std::unique_ptr<SampleSource> open_source(const SourceOptions& options) {
    if (options.source.starts_with(kTrace))
        return std::make_unique<TraceSource>(options.source.substr(kTrace.size()), options);
    refuse(options.source);
}

}  // namespace app
