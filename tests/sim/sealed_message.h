#pragma once
#include <cstdint>
#include <cstring>
#include <vector>

namespace sim_test {

/// Makes the length of a damaged message right, so that what lies behind it is reached.
inline void seal(std::vector<std::uint8_t>& bytes) {
    if (bytes.size() < 28) return;
    const auto length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(bytes.data() + 8, &length, sizeof length);
}

}  // namespace sim_test
