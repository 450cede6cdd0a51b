#include "files/checksum.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "files/bad_input.h"
#include "files/file_descriptor.h"

namespace app {
namespace {

[[noreturn]] void fail_to_read(const std::filesystem::path& file) {
    throw BadInput("error: " + cannot("read " + file.string()));
}

void expect(int openssl_status) {
    if (openssl_status != 1)
        throw std::runtime_error("error: found libcrypto without SHA-256, expected OpenSSL 3");
}

/// FNV-1a over the bits of numbers.
class BitHash {
public:
    void add(double value) { add_bits(std::bit_cast<std::uint64_t>(value), 8); }
    void add(float value) { add_bits(std::bit_cast<std::uint32_t>(value), 4); }
    [[nodiscard]] std::uint64_t state() const { return state_; }

private:
    void add_bits(std::uint64_t bits, int count) {
        std::array<std::uint8_t, 8> bytes{};
        for (int i = 0; i < count; ++i)
            bytes[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(bits >> (8 * i));
        state_ = fnv1a_64(std::span(bytes.data(), static_cast<std::size_t>(count)), state_);
    }
    std::uint64_t state_ = kFnvOffset;
};

/// The functions are called at run time: the compiler may not know the arguments, or it would put in results
/// of its own.
void probe_libm(BitHash& hash) {
    for (int i = 1; i <= 64; ++i) {
        volatile double hidden = 0.1875 * i;
        const double x = hidden;
        for (const double y :
             {std::sin(x), std::cos(x), std::tan(x), std::exp(-x), std::log(x), std::pow(x, 0.3 * x),
              std::atan2(x, 3 - x), std::asin(x / 16), std::cbrt(x), std::tgamma(x), std::erf(x / 4),
              std::sinh(x), std::expm1(x / 64), std::log1p(x), std::hypot(x, 2.5)})
            hash.add(y);
        const float f = static_cast<float>(x);
        for (const float y : {std::sin(f), std::cos(f), std::exp(-f), std::log(f), std::pow(f, 0.3f * f)})
            hash.add(y);
    }
}

}  // namespace

std::string sha256_of_file(const std::filesystem::path& file) {
    const FileDescriptor input(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    if (!input) fail_to_read(file);
    const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
    if (!context) throw std::bad_alloc();
    expect(EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr));
    std::array<std::uint8_t, 65536> block;
    for (;;) {
        const ssize_t got = ::read(input.get(), block.data(), block.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) fail_to_read(file);
        if (got == 0) break;
        expect(EVP_DigestUpdate(context.get(), block.data(), static_cast<std::size_t>(got)));
    }
    std::array<std::uint8_t, 32> digest{};
    expect(EVP_DigestFinal_ex(context.get(), digest.data(), nullptr));
    std::string hex;
    for (const std::uint8_t byte : digest) hex += fmt::format("{:02x}", byte);
    return hex;
}

std::uint64_t fnv1a_64(std::span<const std::uint8_t> bytes, std::uint64_t state) noexcept {
    for (const std::uint8_t byte : bytes) state = (state ^ byte) * 0x100000001b3ULL;
    return state;
}

std::string fingerprint(std::span<const std::uint8_t> test_frame) {
    BitHash probe;
    probe_libm(probe);
    return fmt::format("{:016x}", fnv1a_64(test_frame, probe.state()));
}

}  // namespace app
