#include "trace/stick_names.h"

#include "trace/trace_limits.h"
#include "tracking/input.h"

namespace tracking {

std::string stick_word(std::string_view name) {
    std::string out = printable(name.substr(0, kLongestName));
    for (char& c : out)
        if (c == ' ' || c == '\t' || c == ',' || c == '"' || c == '\'') c = '_';
    return out;
}

std::string unique_name(std::string name, const std::string& substitute, std::size_t number,
                        std::set<std::string>& taken) {
    while (name.empty() || !taken.insert(name).second) name = substitute + std::to_string(number++);
    return name;
}

}  // namespace tracking
