// Models of the predictor `learned`. Their checksum is made right, so that what lies behind it is reached.
#include <cinttypes>

#include "fuzz_target.h"
#include "tracking/path_model.h"
#include "tracking/trace.h"

namespace {

/// FNV-1a, as path_model.h describes the file.
std::uint64_t hash(std::string_view bytes, std::uint64_t state) {
    for (const char byte : bytes) state = (state ^ static_cast<unsigned char>(byte)) * 0x100000001b3ULL;
    return state;
}

std::string with_right_checksum(std::string text) {
    constexpr std::string_view kLine = "\nchecksum: ";
    constexpr std::size_t kDigits = 16;
    const std::size_t end = text.find("\n\n"), line = text.find(kLine);
    if (end == text.npos || line == text.npos || line + kLine.size() + kDigits > end) return text;
    const std::string_view all = text;
    const std::uint64_t sum = hash(all.substr(end + 2), hash(all.substr(0, line + 1), 0xcbf29ce484222325ULL));
    char digits[kDigits + 1];
    std::snprintf(digits, sizeof digits, "%016" PRIx64, sum);
    return text.replace(line + kLine.size(), kDigits, digits);
}

}  // namespace

void fuzz_model(std::string_view bytes) {
    try {
        const std::string text = with_right_checksum(std::string(bytes));
        const tracking::PathModel model = tracking::parse_path_model(text, "fuzz");
        require(tracking::format_path_model(model) == text, "a model that is written otherwise");
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "fuzz:");
    }
}
