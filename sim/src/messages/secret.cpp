#include "messages/secret.h"

#include <sys/random.h>

#include <cerrno>
#include <charconv>
#include <cstring>

#include "sim/errors.h"

namespace sim {

Secret make_secret() {
    Secret secret;
    while (getrandom(secret.data(), secret.size(), 0) != static_cast<ssize_t>(secret.size()))
        if (errno != EINTR)
            throw WorkerError(std::string("cannot get random bytes: ") + std::strerror(errno));
    return secret;
}

std::string to_hex(const Secret& secret) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : secret) {
        text += kDigits[byte / 16];
        text += kDigits[byte % 16];
    }
    return text;
}

std::optional<Secret> from_hex(std::string_view text) {
    Secret secret;
    if (text.size() != 2 * secret.size()) return std::nullopt;
    for (std::size_t i = 0; i < secret.size(); ++i) {
        const char* begin = text.data() + 2 * i;
        const auto [end, error] = std::from_chars(begin, begin + 2, secret[i], 16);
        if (error != std::errc{} || end != begin + 2) return std::nullopt;
    }
    return secret;
}

}  // namespace sim
