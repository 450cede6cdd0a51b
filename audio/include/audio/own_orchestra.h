#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace audio {

// An orchestra of one's own: Csound instruments that are put behind the bundled orchestra, so that they have its macros
// (CLOSE ends a note), opcodes and tables, and its p-fields. A kit is a file that people pass on, so its code may sound
// and do nothing else: no files, no network, no processes, no text to make them of.

/// Throws SampleError (audio/samples.h) "FILE:LINE:COLUMN: error: found ..., expected ..." for a text (of an orchestra, at
/// most 1 MiB) with strings, preprocessor lines, macros put together of parts, opcodes that reach beyond the sound
/// (system, fout, diskin, OSCsend ...), ftgen of a file, header values (sr, ksmps, nchnls, 0dbfs) or an instrument that has
/// one of the names `taken`.
void check_own_orchestra(std::string_view text, const std::string& file, std::span<const std::string> taken);

/// The text of such a file, checked. Throws SampleError.
[[nodiscard]] std::string read_own_orchestra(const std::filesystem::path& file,
                                             std::span<const std::string> taken);

}  // namespace audio
