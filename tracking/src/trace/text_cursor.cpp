#include "trace/text_cursor.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "tracking/trace.h"

namespace tracking {
namespace {

bool is_continuation(char c) {
    return (static_cast<unsigned char>(c) & 0xC0u) == 0x80u;
}

std::string byte_name(char c) {
    constexpr char kHex[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    return std::string("byte 0x") + kHex[byte >> 4] + kHex[byte & 15];
}

/// Bytes of the UTF-8 character at the start of `text`; 0 if there is none (overlong forms, surrogates
/// included).
std::size_t utf8_length(std::string_view text) {
    const auto lead = static_cast<unsigned char>(text[0]);
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xC2 ? 0
                               : lead < 0xE0 ? 2
                               : lead < 0xF0 ? 3
                               : lead < 0xF5 ? 4
                                             : 0;
    if (length == 0 || length > text.size()) return 0;
    if (!std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(length), is_continuation))
        return 0;
    if (length < 3) return length;
    const auto second = static_cast<unsigned char>(text[1]);
    const bool overlong = (lead == 0xE0 && second < 0xA0) || (lead == 0xF0 && second < 0x90);
    const bool outside = (lead == 0xED && second >= 0xA0) || (lead == 0xF4 && second >= 0x90);
    return overlong || outside ? 0 : length;
}

}  // namespace

std::size_t first_unprintable(std::string_view text) {
    std::size_t i = 0;
    while (i < text.size()) {
        const auto byte = static_cast<unsigned char>(text[i]);
        if ((byte < 0x20 && byte != '\t') || byte == 0x7F) return i;
        const std::size_t length = byte < 0x80 ? 1 : utf8_length(text.substr(i));
        if (length == 0) return i;
        if (byte == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0) return i;  // U+0080 to U+009F
        i += length;
    }
    return std::string_view::npos;
}

std::string in_quotes(std::string_view text) {
    constexpr std::size_t kLongest = 40;
    std::size_t cut = std::min(text.size(), kLongest);
    while (cut > 0 && cut < text.size() && is_continuation(text[cut])) --cut;
    std::string out(1, '\'');
    out += printable(text.substr(0, cut));
    out += cut < text.size() ? "...'" : "'";
    return out;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

void Line::fail(std::size_t offset, const std::string& found, const std::string& expected,
                const std::string& remedy) const {
    const std::string_view before = text_.substr(0, std::min(offset, text_.size()));
    const auto inside = std::count_if(before.begin(), before.end(), is_continuation);
    const std::size_t column = before.size() - static_cast<std::size_t>(inside) + 1;
    throw TraceError(printable(*file_) + ":" + std::to_string(number_) + ":" + std::to_string(column) +
                     ": error: found " + found + ", expected " + expected + "; " + remedy);
}

void Line::require_text(const char* remedy) const {
    const std::size_t bad = first_unprintable(text_);
    if (bad == std::string_view::npos) return;
    fail(bad, byte_name(text_[bad]), "UTF-8 text without control characters", remedy);
}

Field Line::next_field(std::size_t& offset) const {
    const std::size_t comma = text_.find(',', offset);
    const std::size_t end = comma == std::string_view::npos ? text_.size() : comma;
    Field field{text_.substr(offset, end - offset), offset};
    while (!field.text.empty() && is_blank(field.text.front())) {
        field.text.remove_prefix(1);
        ++field.offset;
    }
    field.text = trimmed(field.text);
    offset = comma == std::string_view::npos ? comma : comma + 1;
    return field;
}

double Line::number_in(const Field& field, const char* what, double limit, const char* limit_text) const {
    std::string_view digits = field.text;
    if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
    double value = 0;
    const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool whole = end == digits.data() + digits.size() && !digits.empty();
    if (whole && problem == std::errc() && std::abs(value) <= limit) return value;
    const std::string found = field.text.empty() ? "an empty field" : in_quotes(field.text);
    fail(field.offset, found, std::string(what) + ", a number of at most " + limit_text + " in size",
         "correct the number or delete the line");
}

Line LineReader::next() {
    const std::size_t end = rest_.find('\n');
    std::string_view text = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return Line(*file_, ++number_, text);
}

bool LineReader::only_blank_left() const {
    return rest_.find_first_not_of(" \t\r\n") == std::string_view::npos;
}

}  // namespace tracking
