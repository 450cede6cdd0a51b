#include "files/option_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

#include "files/bad_input.h"

namespace app {
namespace {

template <class Number>
std::optional<Number> whole(std::string_view text) {
    Number value{};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc{} || stop != end || text.empty()) return std::nullopt;
    return value;
}

/// "0.01" or "1/15".
std::optional<double> fraction(std::string_view text) {
    const std::size_t slash = text.find('/');
    std::optional<double> value = whole<double>(text.substr(0, slash));
    if (value && slash != std::string_view::npos) {
        const std::optional<double> divisor = whole<double>(text.substr(slash + 1));
        value = divisor && *divisor != 0 ? std::optional(*value / *divisor) : std::nullopt;
    }
    return value && std::isfinite(*value) ? value : std::nullopt;
}

[[noreturn]] void refuse(const std::string& text, const std::string& option, const std::string& expected) {
    throw BadInput(fmt::format("error: found {} \"{}\", expected {}", option, text, expected));
}

}  // namespace

double parse_number(const std::string& text, const std::string& option) {
    const std::optional<double> value = fraction(text);
    if (!value) refuse(text, option, "a number such as 0.05 or a fraction such as 1/15");
    return *value;
}

int parse_whole(const std::string& text, const std::string& option, int low, int high) {
    const std::optional<int> value = whole<int>(text);
    if (!value || *value < low || *value > high)
        refuse(text, option, fmt::format("a whole number from {} to {}", low, high));
    return *value;
}

Eigen::Vector3d parse_vector(const std::string& text, const std::string& option) {
    Eigen::Vector3d result;
    std::string_view rest = text;
    for (int i = 0; i < 3; ++i) {
        const std::size_t comma = rest.find(',');
        const std::optional<double> value = fraction(rest.substr(0, comma));
        if (!value || !(std::abs(*value) <= 1000) || (comma == std::string_view::npos) != (i == 2))
            refuse(text, option, "three numbers X,Y,Z within 1000");
        result[i] = *value;
        rest.remove_prefix(i < 2 ? comma + 1 : 0);
    }
    return result;
}

Eigen::Vector3d parse_axis(const std::string& text, const std::string& option) {
    const bool negative = text.starts_with('-');
    const std::string axis = negative || text.starts_with('+') ? text.substr(1) : text;
    if (axis.size() != 1 || axis[0] < 'x' || axis[0] > 'z') refuse(text, option, "an axis: -z, +y, x ...");
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    result[axis[0] - 'x'] = negative ? -1 : 1;
    return result;
}

Eigen::Vector2i parse_size(const std::string& text, const std::string& option) {
    const std::size_t times = text.find('x');
    const std::optional<int> width = whole<int>(std::string_view(text).substr(0, times));
    const std::optional<int> height =
        times == std::string::npos ? std::nullopt : whole<int>(std::string_view(text).substr(times + 1));
    if (!width || !height) refuse(text, option, "WIDTHxHEIGHT such as 640x480");
    return {*width, *height};
}

}  // namespace app
