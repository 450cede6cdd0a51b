#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace app {

/// SHA-256 of bytes, 64 lower-case hex digits.
[[nodiscard]] std::string sha256_of(std::string_view bytes);
/// The same of a file's. Throws tracking::TraceError when it cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& file);

inline constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325ULL;

/// FNV-1a, 64 bits (Fowler, Noll, Vo). `state` continues an earlier hash.
[[nodiscard]] std::uint64_t fnv1a_64(std::span<const std::uint8_t> bytes,
                                     std::uint64_t state = kFnvOffset) noexcept;

/// What this machine and build compute: FNV-1a 64, 16 hex digits, over the exact bits (little-endian) of
/// libm's results at fixed arguments and then over `test_frame`, the bytes of a picture drawn for the
/// purpose. Two runs whose fingerprints differ need not agree to the bit.
[[nodiscard]] std::string fingerprint(std::span<const std::uint8_t> test_frame);

}  // namespace app
