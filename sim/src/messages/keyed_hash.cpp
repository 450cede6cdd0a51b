#include "messages/keyed_hash.h"

#include <array>
#include <bit>
#include <cstring>

namespace sim {
namespace {

std::uint64_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

void rounds(std::array<std::uint64_t, 4>& v, int count) noexcept {
    for (int i = 0; i < count; ++i) {
        v[0] += v[1], v[1] = std::rotl(v[1], 13) ^ v[0], v[0] = std::rotl(v[0], 32);
        v[2] += v[3], v[3] = std::rotl(v[3], 16) ^ v[2];
        v[0] += v[3], v[3] = std::rotl(v[3], 21) ^ v[0];
        v[2] += v[1], v[1] = std::rotl(v[1], 17) ^ v[2], v[2] = std::rotl(v[2], 32);
    }
}

}  // namespace

std::uint64_t keyed_hash(const Secret& key, std::span<const std::uint8_t> bytes) noexcept {
    const std::uint64_t k0 = word_at(key, 0), k1 = word_at(key, 8);
    std::array<std::uint64_t, 4> v = {k0 ^ 0x736f6d6570736575, k1 ^ 0x646f72616e646f6d,
                                      k0 ^ 0x6c7967656e657261, k1 ^ 0x7465646279746573};
    const auto take = [&v](std::uint64_t word) {
        v[3] ^= word;
        rounds(v, 2);
        v[0] ^= word;
    };
    std::size_t at = 0;
    for (; at + 8 <= bytes.size(); at += 8) take(word_at(bytes, at));
    std::uint64_t last = static_cast<std::uint64_t>(bytes.size()) << 56;
    for (std::size_t i = 0; at + i < bytes.size(); ++i) last |= std::uint64_t{bytes[at + i]} << (8 * i);
    take(last);
    v[2] ^= 0xff;
    rounds(v, 4);
    return v[0] ^ v[1] ^ v[2] ^ v[3];
}

}  // namespace sim
