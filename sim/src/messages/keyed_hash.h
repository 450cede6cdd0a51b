#pragma once
#include <cstdint>
#include <span>

#include "messages/secret.h"

namespace sim {

/// SipHash-2-4 (Aumasson and Bernstein, "SipHash: a fast short-input PRF", 2012): who does not know the key finds
/// no second message with the same hash, but by chance (2^-64).
[[nodiscard]] std::uint64_t keyed_hash(const Secret& key, std::span<const std::uint8_t> bytes) noexcept;

}  // namespace sim
