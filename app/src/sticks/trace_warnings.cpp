#include "sticks/trace_warnings.h"

#include <fmt/format.h>
#include <tracking/plausibility.h>

#include <string>

#include "process/standard_streams.h"

namespace app {
namespace {

void warn(const tracking::Trace& trace, const std::string& line) {
    tell(fmt::format("{}: warning: {}", trace.file, line));
}

}  // namespace

void warn_of_implausible(const tracking::Trace& trace) {
    for (const std::string& line : tracking::implausible(trace)) warn(trace, line);
}

void warn_of_units(const tracking::Trace& trace) {
    if (const std::optional<std::string> line = tracking::implausible_units(trace)) warn(trace, *line);
}

}  // namespace app
