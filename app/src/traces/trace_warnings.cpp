#include "traces/trace_warnings.h"

#include <fmt/format.h>
#include <tracking/plausibility.h>

#include <cstdio>

namespace app {

void warn_of_implausible(const tracking::Trace& trace) {
    for (const std::string& line : tracking::implausible(trace))
        fmt::print(stderr, "{}: warning: {}\n", trace.file, line);
}

}  // namespace app
