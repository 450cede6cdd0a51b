#include "messages/crc32c.h"

#include <array>
#include <cstring>
#ifdef __SSE4_2__
#include <nmmintrin.h>
#endif

namespace sim {
namespace {

constexpr std::array<std::uint32_t, 256> crc32c_table() {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t c = i;
        for (int k = 0; k < 8; ++k) c = (c & 1) ? 0x82F63B78u ^ (c >> 1) : c >> 1;
        table[i] = c;
    }
    return table;
}

}  // namespace

std::uint32_t crc32c_by_table(std::span<const std::uint8_t> bytes) noexcept {
    static constexpr std::array<std::uint32_t, 256> kTable = crc32c_table();
    std::uint32_t c = 0xFFFFFFFFu;
    for (const std::uint8_t byte : bytes) c = kTable[(c ^ byte) & 0xFF] ^ (c >> 8);
    return ~c;
}

#ifdef __SSE4_2__
std::uint32_t crc32c(std::span<const std::uint8_t> bytes) noexcept {
    std::uint64_t c = 0xFFFFFFFFu;
    const std::uint8_t* at = bytes.data();
    std::size_t left = bytes.size();
    for (; left >= 8; at += 8, left -= 8) {
        std::uint64_t eight;
        std::memcpy(&eight, at, sizeof eight);
        c = _mm_crc32_u64(c, eight);
    }
    auto rest = static_cast<std::uint32_t>(c);
    for (; left > 0; ++at, --left) rest = _mm_crc32_u8(rest, *at);
    return ~rest;
}
#else
std::uint32_t crc32c(std::span<const std::uint8_t> bytes) noexcept {
    return crc32c_by_table(bytes);
}
#endif

}  // namespace sim
