#pragma once
#include <tracking/trace.h>

namespace app {

/// Says on standard error, a line each, what a trace holds that recordings of drummers do not
/// (tracking::implausible).
void warn_of_implausible(const tracking::Trace& trace);

}  // namespace app
