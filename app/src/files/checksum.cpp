#include "files/checksum.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <tracking/input.h>

#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace app {
namespace {

/// FNV-1a over the bits of numbers, little-endian.
void add(std::uint64_t& hash, auto value) {
    hash = fnv1a_64(std::bit_cast<std::array<std::uint8_t, sizeof value>>(value), hash);
}

/// The functions are called at run time: the compiler may not know the arguments, or it would put in results
/// of its own.
void probe_libm(std::uint64_t& hash) {
    for (int i = 1; i <= 64; ++i) {
        volatile double hidden = 0.1875 * i;
        const double x = hidden;
        for (const double y :
             {std::sin(x), std::cos(x), std::tan(x), std::exp(-x), std::log(x), std::pow(x, 0.3 * x),
              std::atan2(x, 3 - x), std::asin(x / 16), std::cbrt(x), std::tgamma(x), std::erf(x / 4),
              std::sinh(x), std::expm1(x / 64), std::log1p(x), std::hypot(x, 2.5)})
            add(hash, y);
        const float f = static_cast<float>(x);
        for (const float y : {std::sin(f), std::cos(f), std::exp(-f), std::log(f), std::pow(f, 0.3f * f)})
            add(hash, y);
    }
}

}  // namespace

std::string sha256_of(std::string_view bytes) {
    std::array<std::uint8_t, 32> digest{};
    if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), nullptr, EVP_sha256(), nullptr) != 1)
        throw std::runtime_error("error: found libcrypto without SHA-256, expected OpenSSL 3");
    return fmt::format("{:02x}", fmt::join(digest, ""));
}

std::string sha256_of_file(const std::filesystem::path& file) {
    return sha256_of(tracking::read_bytes(file.string(), "a file that can be read"));
}

std::uint64_t fnv1a_64(std::span<const std::uint8_t> bytes, std::uint64_t state) noexcept {
    for (const std::uint8_t byte : bytes) state = (state ^ byte) * 0x100000001b3ULL;
    return state;
}

std::string fingerprint(std::span<const std::uint8_t> test_frame) {
    std::uint64_t hash = kFnvOffset;
    probe_libm(hash);
    return fmt::format("{:016x}", fnv1a_64(test_frame, hash));
}

}  // namespace app
