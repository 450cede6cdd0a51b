#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace app {

/// Writes FILE.partial, then renames it: FILE is never seen half-written, and an older one stays until the
/// new one is complete. Throws BadInput when FILE cannot be made there (no such folder, a folder of that
/// name), std::runtime_error when writing fails.
void write_finished_file(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
void write_finished_file(const std::filesystem::path& file, std::string_view text);

}  // namespace app
