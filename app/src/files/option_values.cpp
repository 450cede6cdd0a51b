#include "files/option_values.h"

#include <fmt/format.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "files/bad_input.h"

namespace app {
namespace {

template <class Number>
std::optional<Number> whole_text(std::string_view text) {
    Number value{};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc{} || stop != end || text.empty()) return std::nullopt;
    return value;
}

/// "0.01" or "1/15".
std::optional<double> fraction(std::string_view text) {
    const std::size_t slash = text.find('/');
    std::optional<double> value = whole_text<double>(text.substr(0, slash));
    if (value && slash != std::string_view::npos) {
        const std::optional<double> divisor = whole_text<double>(text.substr(slash + 1));
        value = divisor && *divisor != 0 ? std::optional(*value / *divisor) : std::nullopt;
    }
    return value && std::isfinite(*value) ? value : std::nullopt;
}

/// "0.05", "1e+15"; "1/30" for what has no short decimals.
std::string short_number(double value) {
    constexpr std::size_t kShort = 8;
    if (std::abs(value) >= 1e9) return fmt::format("{:g}", value);
    std::string decimals = fmt::format("{}", value);
    if (decimals.size() <= kShort || value == 0) return decimals;
    const double parts = std::round(1 / value);
    return 1 / parts == value ? fmt::format("1/{}", parts) : decimals;
}

std::string with_unit(const std::string& text, const std::string& unit) {
    return unit.empty() ? text : text + " " + unit;
}

ValueFormat<double> number_where(const std::string& range, const std::string& unit, double units_per_value,
                                 std::function<bool(double)> holds) {
    const std::string in_units = with_unit(range, unit);
    return {"NUMBER", in_units,
            in_units.empty() ? "a number or a fraction such as 1/15" : "a number " + in_units,
            [units_per_value, holds = std::move(holds)](const std::string& text) {
                const std::optional<double> value = fraction(text);
                return value && holds(*value) ? std::optional(*value / units_per_value) : std::nullopt;
            },
            [units_per_value](double value) { return short_number(value * units_per_value); }};
}

/// N numbers separated by commas.
template <class Vector>
ValueFormat<Vector> vector_of(const std::string& placeholder, const ValueFormat<double>& one) {
    const auto read = [one](const std::string& text) -> std::optional<Vector> {
        const std::vector<std::string> parts = split(text);
        Vector result;
        if (static_cast<Eigen::Index>(parts.size()) != result.size()) return std::nullopt;
        for (Eigen::Index i = 0; i < result.size(); ++i) {
            const std::optional<double> value = one.read(parts[static_cast<std::size_t>(i)]);
            if (!value) return std::nullopt;
            result[i] = *value;
        }
        return result;
    };
    return {placeholder, "each " + one.range, placeholder + ", each " + one.expected, read, {}};
}

}  // namespace

void check_video_name(const std::string& file) {
    std::string ending = std::filesystem::path(file).extension().string();
    for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (!ending.empty() && ending != ".mp4")
        refuse_options("--video " + one_line(file), "a name that ends in .mp4");
}

void refuse_options(const std::string& found, const std::string& expected) {
    throw BadInput(fmt::format("error: found {}, expected {}", found, expected));
}

void refuse_value(const std::string& name, const std::string& text, const std::string& expected) {
    refuse_options(name + " " + (text.empty() ? "\"\"" : text), expected);
}

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(separator, begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

std::string one_of(const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i)
        text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return text;
}

namespace as {

ValueFormat<double> number(double least, double most, const std::string& unit, double units_per_value) {
    const std::string range = least == -kAny ? ""
                              : most == kAny
                                  ? fmt::format("of at least {}", short_number(least))
                                  : fmt::format("from {} to {}", short_number(least), short_number(most));
    return number_where(range, unit, units_per_value,
                        [least, most](double value) { return value >= least && value <= most; });
}

ValueFormat<double> number_above(double least, double most, const std::string& unit) {
    return number_where(most == kAny ? fmt::format("above {}", least)
                                     : fmt::format("above {}, up to {}", least, short_number(most)),
                        unit, 1, [least, most](double value) { return value > least && value <= most; });
}

ValueFormat<double> number_between(double least, double most, const std::string& unit) {
    return number_where(fmt::format("above {} and below {}", least, most), unit, 1,
                        [least, most](double value) { return value > least && value < most; });
}

ValueFormat<std::int64_t> whole(std::int64_t least, std::int64_t most, const std::string& unit) {
    const bool bounded = most < std::numeric_limits<std::int64_t>::max();
    const std::string range = with_unit(
        bounded ? fmt::format("from {} to {}", least, most) : fmt::format("of at least {}", least), unit);
    return {"N", range, "a whole number " + range,
            [least, most](const std::string& text) {
                const std::optional<std::int64_t> value = whole_text<std::int64_t>(text);
                return value && *value >= least && *value <= most ? value : std::nullopt;
            },
            [](std::int64_t value) { return fmt::format("{}", value); }};
}

ValueFormat<std::string> text(const std::string& placeholder, std::function<void(const std::string&)> check) {
    return {placeholder, "", placeholder,
            [check = std::move(check)](const std::string& text) {
                if (check) check(text);
                return std::optional(text);
            },
            [](const std::string& value) { return value; }};
}

ValueFormat<Eigen::Vector3d> vector_of_3(const ValueFormat<double>& one) {
    return vector_of<Eigen::Vector3d>("X,Y,Z", one);
}

ValueFormat<Eigen::Vector2d> vector_of_2(const ValueFormat<double>& one) {
    return vector_of<Eigen::Vector2d>("A,B", one);
}

ValueFormat<Eigen::Vector3d> axis() {
    const auto read = [](const std::string& text) -> std::optional<Eigen::Vector3d> {
        const bool negative = text.starts_with('-');
        const std::string letter = negative || text.starts_with('+') ? text.substr(1) : text;
        if (letter.size() != 1 || letter[0] < 'x' || letter[0] > 'z') return std::nullopt;
        Eigen::Vector3d result = Eigen::Vector3d::Zero();
        result[letter[0] - 'x'] = negative ? -1 : 1;
        return result;
    };
    return {"AXIS", "x, +y, -z ...", "an axis such as -z, +y or x", read, {}};
}

ValueFormat<Eigen::Vector2i> pixels(int least, int most) {
    const std::string range = fmt::format("{0}x{0} to {1}x{1}", least, most);
    const auto read = [least, most](const std::string& text) -> std::optional<Eigen::Vector2i> {
        const std::size_t times = std::min(text.find('x'), text.size());
        const std::optional<int> width = whole_text<int>(std::string_view(text).substr(0, times));
        const std::optional<int> height =
            whole_text<int>(std::string_view(text).substr(std::min(times + 1, text.size())));
        if (!width || !height || std::min(*width, *height) < least || std::max(*width, *height) > most)
            return std::nullopt;
        return Eigen::Vector2i(*width, *height);
    };
    return {"WIDTHxHEIGHT", range + " pixels", "WIDTHxHEIGHT such as 640x480, " + range, read,
            [](const Eigen::Vector2i& size) { return fmt::format("{}x{}", size.x(), size.y()); }};
}

ValueFormat<std::pair<std::string, std::string>> named(const std::string& placeholder, PartedAt parted) {
    const auto read =
        [parted](const std::string& text) -> std::optional<std::pair<std::string, std::string>> {
        const std::size_t equals = parted == PartedAt::last ? text.rfind('=') : text.find('=');
        if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) return std::nullopt;
        return std::pair(text.substr(0, equals), text.substr(equals + 1));
    };
    return {placeholder, "", placeholder, read, {}};
}

ValueFormat<std::string> choice(const std::vector<std::string>& words) {
    std::vector<std::pair<std::string, std::string>> choices;
    for (const std::string& word : words) choices.emplace_back(word, word);
    return choice(std::move(choices));
}

}  // namespace as
}  // namespace app
