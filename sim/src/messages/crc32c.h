#pragma once
#include <cstdint>
#include <span>

namespace sim {

/// CRC-32C (Castagnoli, as in iSCSI, RFC 3720): reflected, polynomial 0x1EDC6F41, start and final complement.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace sim
