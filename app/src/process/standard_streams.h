#pragma once
#include <string_view>

namespace app {

/// Opens the standard streams that were closed before the program began, so that no file of ours takes their
/// numbers: writing to them fails, as it would have.
void hold_closed_streams();

/// Prints one line on standard error: what no terminal should get becomes '?'. Where that cannot be written, the
/// line is lost and nothing else.
void tell(std::string_view line) noexcept;
/// The same without the line's end, for a progress bar; `text` is ours.
void tell_as_is(std::string_view text) noexcept;

}  // namespace app
