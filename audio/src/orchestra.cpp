#include "audio/orchestra.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace audio {
namespace {

constexpr std::string_view kMark = ";@";
constexpr std::string_view kForm = "`;@ instrument parameter default minimum maximum text`";

std::string in_ticks(std::string_view word) {
    std::string text(1, '`');
    text.append(word);
    text.push_back('`');
    return text;
}

[[noreturn]] void refuse(const std::string& file, std::size_t line, const std::string& found,
                         std::string_view expected) {
    throw std::runtime_error(file + ":" + std::to_string(line) + ":1: error: found " + found + ", expected " +
                             std::string(expected));
}

std::string_view take_word(std::string_view& rest) {
    const std::size_t begin = std::min(rest.find_first_not_of(" \t\r"), rest.size());
    rest.remove_prefix(begin);
    const std::string_view word = rest.substr(0, rest.find_first_of(" \t\r"));
    rest.remove_prefix(word.size());
    return word;
}

bool is_name(std::string_view word) {
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    return !word.empty() && letter(word.front()) &&
           std::all_of(word.begin(), word.end(), [&](char c) { return letter(c) || digit(c); });
}

bool read_number(std::string_view word, double& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && std::isfinite(value);
}

Parameter parse_parameter(std::string_view rest, const std::string& file, std::size_t line) {
    Parameter parameter;
    const std::string_view name = take_word(rest);
    if (!is_name(name)) refuse(file, line, "parameter " + in_ticks(name), kForm);
    parameter.name = name;
    for (double* value : {&parameter.fallback, &parameter.minimum, &parameter.maximum}) {
        const std::string_view word = take_word(rest);
        if (!read_number(word, *value))
            refuse(file, line, word.empty() ? "too few words" : in_ticks(word),
                   std::string(kForm) + ", its numbers finite");
    }
    if (!(parameter.minimum <= parameter.fallback && parameter.fallback <= parameter.maximum)) {
        refuse(file, line, "default outside its range", "minimum <= default <= maximum");
    }
    const std::size_t text = std::min(rest.find_first_not_of(" \t\r"), rest.size());
    const std::size_t end = rest.find_last_not_of(" \t\r");
    parameter.text = text < rest.size() ? rest.substr(text, end + 1 - text) : std::string_view{};
    return parameter;
}

void add_declaration(std::vector<Instrument>& instruments, std::string_view rest, const std::string& file,
                     std::size_t line) {
    const std::string_view name = take_word(rest);
    if (!is_name(name)) refuse(file, line, "instrument " + in_ticks(name), kForm);
    Parameter parameter = parse_parameter(rest, file, line);
    auto instrument = std::ranges::find(instruments, name, &Instrument::name);
    if (instrument == instruments.end()) {
        instruments.push_back({std::string(name), {}});
        instrument = instruments.end() - 1;
    }
    if (std::ranges::count(instrument->parameters, parameter.name, &Parameter::name) != 0) {
        refuse(file, line, "a second " + in_ticks(parameter.name) + " of " + in_ticks(name), "each once");
    }
    instrument->parameters.push_back(std::move(parameter));
}

std::string known_names(const Instrument& instrument) {
    std::string names;
    for (const Parameter& parameter : instrument.parameters) {
        if (!names.empty()) names += ", ";
        names += parameter.name;
    }
    return names.empty() ? "none" : names;
}

}  // namespace

std::vector<Instrument> parse_instruments(std::string_view orchestra, const std::string& file) {
    std::vector<Instrument> instruments;
    for (std::size_t line = 1; !orchestra.empty(); ++line) {
        const std::size_t length = std::min(orchestra.find('\n'), orchestra.size());
        const std::string_view text = orchestra.substr(0, length);
        orchestra.remove_prefix(std::min(length + 1, orchestra.size()));
        if (text.starts_with(kMark)) {
            add_declaration(instruments, text.substr(kMark.size()), file, line);
        }
    }
    return instruments;
}

std::string read_text(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file)) {
        throw std::runtime_error("cannot read the orchestra " + file.string());
    }
    std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (stream.bad()) throw std::runtime_error(file.string() + ": reading failed");
    return text;
}

std::vector<Instrument> read_instruments(const std::filesystem::path& orchestra) {
    return parse_instruments(read_text(orchestra), orchestra.string());
}

std::vector<double> resolve_parameters(const Instrument& instrument,
                                       const std::vector<std::pair<std::string, double>>& given,
                                       const std::string& owner) {
    std::vector<double> values;
    for (const Parameter& parameter : instrument.parameters) values.push_back(parameter.fallback);
    std::vector<bool> seen(values.size(), false);
    for (const auto& [name, value] : given) {
        const auto parameter = std::ranges::find(instrument.parameters, name, &Parameter::name);
        const auto place = static_cast<std::size_t>(parameter - instrument.parameters.begin());
        if (parameter == instrument.parameters.end() || seen[place]) {
            throw std::runtime_error(owner + ": found parameter " + in_ticks(name) + " of instrument " +
                                     in_ticks(instrument.name) +
                                     ", expected each at most once of: " + known_names(instrument));
        }
        if (!(value >= parameter->minimum && value <= parameter->maximum)) {
            std::string what = owner;
            what.append(": found ").append(name).append(" = ").append(std::to_string(value));
            what.append(", expected ").append(std::to_string(parameter->minimum));
            what.append(" to ").append(std::to_string(parameter->maximum));
            throw std::runtime_error(what);
        }
        values[place] = value;
        seen[place] = true;
    }
    return values;
}

}  // namespace audio
