#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

/// Bytes with one to three places changed, cut off, put in or written over.
inline std::vector<std::uint8_t> damaged(std::vector<std::uint8_t> bytes, std::mt19937& random) {
    for (unsigned n = 1 + random() % 3; n > 0 && !bytes.empty(); --n) {
        const std::size_t at = random() % bytes.size();
        switch (random() % 5) {
            case 0:
                bytes[at] ^= static_cast<std::uint8_t>(1u << random() % 8);
                break;
            case 1:
                bytes[at] = random() % 2 ? 0xFF : 0x00;
                break;
            case 2:
                bytes.resize(at);
                break;
            case 3:
                bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), random() % 9,
                             static_cast<std::uint8_t>(random()));
                break;
            default:
                std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                            std::min<std::size_t>(8, bytes.size() - at), static_cast<std::uint8_t>(random()));
        }
    }
    return bytes;
}
