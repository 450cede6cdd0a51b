#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "messages/crc32c.h"

namespace sim_test {

/// Makes the length and the checksum of a damaged message right, so that what lies behind them is reached.
inline void seal(std::vector<std::uint8_t>& bytes) {
    if (bytes.size() < 32) return;
    const auto length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(bytes.data() + 8, &length, sizeof length);
    const std::uint32_t sum = sim::crc32c(std::span(bytes).first(bytes.size() - 4));
    std::memcpy(bytes.data() + bytes.size() - 4, &sum, sizeof sum);
}

}  // namespace sim_test
