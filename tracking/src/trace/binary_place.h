#pragma once
#include <string>

#include "tracking/input.h"
#include "tracking/trace.h"

namespace tracking {

/// Throws TraceError: FILE:byte N: error: found `found`, expected `expected`; `remedy`.
[[noreturn]] inline void fail_at_byte(
    const std::string& file, std::size_t at, const std::string& found, const std::string& expected,
    const std::string& remedy = "check that the file is complete, or export it again") {
    throw TraceError(printable(file) + ":byte " + std::to_string(at) + ": error: found " + found +
                     ", expected " + expected + "; " + remedy);
}

}  // namespace tracking
