#include "messages/crc32c.h"

#include <isa-l/crc.h>

#include <algorithm>

namespace sim {

// The library counts in int, and does not write.
std::uint32_t crc32c(std::span<const std::uint8_t> bytes) noexcept {
    constexpr std::size_t kMost = std::size_t{1} << 30;
    std::uint32_t c = 0xFFFFFFFFu;
    while (!bytes.empty()) {
        const auto some = bytes.first(std::min(bytes.size(), kMost));
        c = crc32_iscsi(const_cast<std::uint8_t*>(some.data()), static_cast<int>(some.size()), c);
        bytes = bytes.subspan(some.size());
    }
    return ~c;
}

}  // namespace sim
