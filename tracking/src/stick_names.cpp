#include "stick_names.h"

#include "trace_limits.h"
#include "tracking/input.h"

namespace tracking {

std::string stick_word(std::string_view name) {
    std::string out = printable(name.substr(0, kLongestName));
    for (char& c : out)
        if (c == ' ' || c == '\t' || c == ',' || c == '"' || c == '\'') c = '_';
    return out;
}

}  // namespace tracking
