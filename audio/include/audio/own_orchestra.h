#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace audio {

// An orchestra of one's own: Csound instruments that are put behind the bundled orchestra, so that they have its macros
// (STROKE begins a note, CLOSE ends it), opcodes and p-fields. A kit is a file that people pass on, so its code may sound and do nothing
// else: what it may say is a list (own_orchestra.cpp), and Csound gets what was read here, not the file.

/// What Csound gets of such a text (at most 1 MiB): instruments without their comments, lines `;@` that declare parameters between
/// them. Throws SampleError (audio/samples.h) "FILE:LINE:COLUMN: error: found ..., expected ..." for words that are not listed, texts,
/// anything but comments outside instruments, loops, and an instrument that has one of the names `taken`. (Fuzzed.)
[[nodiscard]] std::string checked_own_orchestra(std::string_view text, const std::string& file,
                                                std::span<const std::string> taken);

/// Compiles such a checked text behind the text of the bundled orchestra. Throws SampleError at the line that Csound refuses, which
/// is found by halving: Csound's own line numbers do not count the lines of macros.
void compile_own_orchestra(const std::string& bundled, const std::string& checked, const std::string& file);

/// Reads, checks and compiles a file's. Throws SampleError.
void check_own_orchestra(const std::filesystem::path& bundled, const std::filesystem::path& own);

/// What Csound gets of a file. Throws SampleError.
[[nodiscard]] std::string read_own_orchestra(const std::filesystem::path& file,
                                             std::span<const std::string> taken);

}  // namespace audio
