#include "files/one_line.h"

namespace app {

std::string one_line(std::string_view text, std::size_t longest) {
    std::string line(text.substr(0, longest));
    if (line.size() < text.size())  // no part of a character at the end
        while (!line.empty() && (static_cast<unsigned char>(line.back()) & 0x80) != 0) line.pop_back();
    for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return line.size() < text.size() ? line + "..." : line;
}

std::string counted(std::uint64_t count, std::string_view one) {
    const std::string number = std::to_string(count) + " ";
    if (count == 1) return number + std::string(one);
    if (one.ends_with('y')) return number + std::string(one.substr(0, one.size() - 1)) + "ies";
    return number + std::string(one) + "s";
}

}  // namespace app
