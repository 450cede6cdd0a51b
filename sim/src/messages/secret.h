#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sim {

/// By what an application knows a worker again, on whatever connection it comes: random, known to these two
/// alone. A worker says it when it asks to join and with each heartbeat. All zeros: none.
using Secret = std::array<std::uint8_t, 16>;

[[nodiscard]] Secret make_secret();                                   ///< throws WorkerError
[[nodiscard]] std::string to_hex(const Secret& secret);               ///< 32 digits
[[nodiscard]] std::optional<Secret> from_hex(std::string_view text);  ///< none unless it is such

}  // namespace sim
