#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace audio {

/// One parameter of an instrument, as the orchestra file declares it.
struct Parameter {
    std::string name;
    double fallback = 0;  ///< the value where a voice gives none
    double minimum = 0;
    double maximum = 0;
    std::string text;  ///< meaning and unit
};

/// One instrument of the orchestra; the order of its parameters is the order of the p-fields from p12 on.
struct Instrument {
    std::string name;
    std::vector<Parameter> parameters;
};

/// The instruments that an orchestra's text declares by lines `;@ instrument parameter default minimum
/// maximum text`. Throws std::runtime_error "FILE:LINE:1: error: found ..., expected ..." for a line that is not of
/// that form.
[[nodiscard]] std::vector<Instrument> parse_instruments(std::string_view orchestra, const std::string& file);

/// The same, of a file; throws std::runtime_error where it cannot be read.
[[nodiscard]] std::vector<Instrument> read_instruments(const std::filesystem::path& orchestra);

/// The instrument's parameters in its order: the given ones, the declared defaults elsewhere. Throws
/// std::runtime_error for an unknown or repeated name or a value that is not finite or out of range, naming
/// `owner` (the kit's voice).
[[nodiscard]] std::vector<double> resolve_parameters(const Instrument& instrument,
                                                     const std::vector<std::pair<std::string, double>>& given,
                                                     const std::string& owner);

/// The whole text of a file; throws std::runtime_error.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

}  // namespace audio
