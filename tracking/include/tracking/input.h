#pragma once
#include <string>
#include <string_view>

namespace tracking {

/// `text` with question marks for control characters and what is not UTF-8, blanks for tabs: fit for a terminal.
[[nodiscard]] std::string printable(std::string_view text);

/// The bytes of a regular file, or of a pipe up to its end, at most 1 GiB. Somebody must open a named pipe for
/// writing within ten seconds. Throws TraceError for devices, sockets, folders and what cannot be read:
/// FILE:1:1: error: found ..., expected `expected`; what to do.
[[nodiscard]] std::string read_bytes(const std::string& file,
                                     const std::string& expected = "a trace file that can be read");

}  // namespace tracking
