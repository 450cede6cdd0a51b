#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace app {

/// Throws BadInput "error: found FOUND, expected EXPECTED".
[[noreturn]] void refuse_options(const std::string& found, const std::string& expected);
/// Throws BadInput "error: found NAME TEXT, expected EXPECTED".
[[noreturn]] void refuse_value(const std::string& name, const std::string& text, const std::string& expected);

/// Throws BadInput for a video's name that ends in something else than .mp4 (or nothing): an MP4 is what is made.
void check_video_name(const std::string& file);

/// How a value is written on the command line, or in a part of a longer text.
template <class Value>
struct ValueFormat {
    std::string placeholder;  ///< stands for the value in the help: "N", "X,Y,Z", "on|off"
    std::string range;        ///< in the help: "1 to 1000 Hz"; may be empty
    std::string expected;     ///< in an error, after "expected"
    std::function<std::optional<Value>(const std::string&)> read;  ///< none: the text is no such value
    std::function<std::string(const Value&)> write;                ///< for the help

    /// Throws BadInput "error: found NAME TEXT, expected ...".
    [[nodiscard]] Value parse(const std::string& text, const std::string& name) const {
        std::optional<Value> value = read(text);
        if (!value) refuse_value(name, text, expected);
        return *std::move(value);
    }
};

/// The parts between the separators, one more than there are separators.
[[nodiscard]] std::vector<std::string> split(const std::string& text, char separator = ',');

/// "a, b, c or d".
[[nodiscard]] std::string one_of(const std::vector<std::string>& words);

/// Formats, as in option("--fps", fps, as::number(1, 1000, "Hz"), ...).
namespace as {

inline constexpr double kAny = std::numeric_limits<double>::infinity();

/// "0.05", "1e-3" or a fraction such as "1/15", finite. In the text the number counts `unit`s, of which
/// `units_per_value` make one of the value: 1000 for millimetres that become metres.
[[nodiscard]] ValueFormat<double> number(double least = -kAny, double most = kAny,
                                         const std::string& unit = "", double units_per_value = 1);
/// The same without the bound `least`, and without both.
[[nodiscard]] ValueFormat<double> number_above(double least, double most, const std::string& unit = "");
[[nodiscard]] ValueFormat<double> number_between(double least, double most, const std::string& unit = "");

/// "12".
[[nodiscard]] ValueFormat<std::int64_t> whole(std::int64_t least, std::int64_t most,
                                              const std::string& unit = "");

/// Any text; `check` throws BadInput for what cannot be.
[[nodiscard]] ValueFormat<std::string> text(const std::string& placeholder,
                                            std::function<void(const std::string&)> check = {});

/// "X,Y,Z", each as `one`.
[[nodiscard]] ValueFormat<Eigen::Vector3d> vector_of_3(const ValueFormat<double>& one);
/// "A,B", each as `one`.
[[nodiscard]] ValueFormat<Eigen::Vector2d> vector_of_2(const ValueFormat<double>& one);
/// A body axis: "-z", "+y", "x".
[[nodiscard]] ValueFormat<Eigen::Vector3d> axis();
/// "640x480" as width and height, each from `least` to `most`.
[[nodiscard]] ValueFormat<Eigen::Vector2i> pixels(int least, int most);

enum class PartedAt { first, last };
/// "TEXT=NAME", parted at the first `=` or at the last; neither may be empty.

[[nodiscard]] ValueFormat<std::pair<std::string, std::string>> named(const std::string& placeholder,
                                                                     PartedAt parted = PartedAt::first);

/// One of a few words, each of which means a value.
template <class Value>
[[nodiscard]] ValueFormat<Value> choice(std::vector<std::pair<std::string, Value>> choices) {
    ValueFormat<Value> format;
    std::vector<std::string> words;
    for (const auto& [word, value] : choices) {
        words.push_back(word);
        format.placeholder += (words.size() == 1 ? "" : "|") + word;
    }
    format.expected = one_of(words);
    format.read = [choices](const std::string& text) -> std::optional<Value> {
        for (const auto& [word, value] : choices)
            if (word == text) return value;
        return std::nullopt;
    };
    format.write = [choices](const Value& value) -> std::string {
        for (const auto& [word, meant] : choices)
            if (meant == value) return word;
        return "";
    };
    return format;
}
/// Words that mean themselves.
[[nodiscard]] ValueFormat<std::string> choice(const std::vector<std::string>& words);

/// Different values, separated by commas.
template <class Value>
[[nodiscard]] ValueFormat<std::vector<Value>> list_of(const ValueFormat<Value>& one) {
    ValueFormat<std::vector<Value>> format{one.placeholder + ",...",
                                           one.range.empty() ? "" : "each " + one.range,
                                           "a list with commas, none twice, each " + one.expected,
                                           {},
                                           {}};
    format.read = [one](const std::string& text) -> std::optional<std::vector<Value>> {
        std::vector<Value> values;
        for (const std::string& part : split(text)) {
            const std::optional<Value> value = part.empty() ? std::nullopt : one.read(part);
            if (!value || std::find(values.begin(), values.end(), *value) != values.end())
                return std::nullopt;
            values.push_back(*value);
        }
        return values;
    };
    format.write = [one](const std::vector<Value>& values) {
        std::string text;
        for (const Value& value : values) text += (text.empty() ? "" : ",") + one.write(value);
        return text;
    };
    return format;
}

}  // namespace as
}  // namespace app
