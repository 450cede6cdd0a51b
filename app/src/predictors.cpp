#include "predictors.h"

#include <stdexcept>

#include "bad_input.h"

namespace app {

std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                        std::span<const double> /*leads_s*/) {
    return tracking::make_predictor(specification);
}

std::vector<std::string> split_specifications(const std::string& list) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= list.size();) {
        const std::size_t comma = std::min(list.find(',', begin), list.size());
        const std::string part = list.substr(begin, comma - begin);
        if (!parts.empty() && part.find('=') != std::string::npos && part.find(':') == std::string::npos)
            parts.back() += "," + part;
        else
            parts.push_back(part);
        begin = comma + 1;
    }
    return parts;
}

}  // namespace app
