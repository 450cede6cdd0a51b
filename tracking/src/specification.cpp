#include "specification.h"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include "trace/text_cursor.h"

namespace tracking {
namespace {

std::string shown(double number) {
    char digits[32];
    return std::string(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

}  // namespace

Specification::Specification(const std::string& text) : text_(text) {
    const std::size_t colon = text.find(':');
    name_ = text.substr(0, colon);
    if (colon == std::string::npos) return;
    for (std::size_t begin = colon + 1; begin <= text.size();) {
        const std::size_t comma = std::min(text.find(',', begin), text.size());
        add(text.substr(begin, comma - begin));
        begin = comma + 1;
    }
}

void Specification::add(const std::string& assignment) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size())
        fail(assignment.empty() ? "an empty parameter" : in_quotes(assignment), "key=value");
    if (!values_.emplace(assignment.substr(0, equals), assignment.substr(equals + 1)).second)
        fail(in_quotes(assignment.substr(0, equals)) + " twice", "each key once");
}

double Specification::number(const std::string& key, double otherwise, double least, double most) {
    asked_[key] = true;
    const auto given = values_.find(key);
    if (given == values_.end()) return otherwise;
    const std::string& digits = given->second;
    double value = 0;
    const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (end != digits.data() + digits.size() || problem != std::errc() || !(value >= least && value <= most))
        fail(key + "=" + in_quotes(digits), "a number from " + shown(least) + " to " + shown(most));
    return value;
}

std::size_t Specification::whole(const std::string& key, std::size_t otherwise, std::size_t least,
                                 std::size_t most) {
    const double value =
        number(key, static_cast<double>(otherwise), static_cast<double>(least), static_cast<double>(most));
    if (value != std::floor(value)) fail(key + " that is not whole", "a whole number");
    return static_cast<std::size_t>(value);
}

bool Specification::word(const std::string& key, const std::string& only) {
    asked_[key] = true;
    const auto given = values_.find(key);
    if (given == values_.end()) return false;
    if (given->second != only) fail(key + "=" + in_quotes(given->second), key + "=" + only);
    return true;
}

void Specification::require_no_others() const {
    std::string known;
    for (const auto& [key, asked] : asked_) known += (known.empty() ? "" : ", ") + key;
    for (const auto& [key, value] : values_)
        if (!asked_.contains(key))
            fail("parameter " + in_quotes(key), known.empty() ? "no parameters" : "only " + known);
}

void Specification::fail(const std::string& found, const std::string& expected) const {
    throw std::invalid_argument("predictor " + in_quotes(text_) + ": found " + found + ", expected " +
                                expected);
}

}  // namespace tracking
