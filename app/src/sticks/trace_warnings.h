#pragma once
#include <tracking/trace.h>

namespace app {

/// Prints to standard error, a line each, what a trace holds that recordings of drummers do not
/// (tracking::implausible).
void warn_of_implausible(const tracking::Trace& trace);
/// The one of these lines that tells of units that are not metres and seconds, if there is one.
void warn_of_units(const tracking::Trace& trace);

}  // namespace app
