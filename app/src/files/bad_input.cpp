#include "files/bad_input.h"

#include <algorithm>
#include <numeric>

namespace app {
namespace {

/// How many letters must be put in, left out or exchanged to make one word of the other.
std::size_t distance_between(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0]++;
        for (std::size_t k = 1; k <= b.size(); ++k) {
            const std::size_t exchanged = diagonal + (a[i - 1] == b[k - 1] ? 0 : 1);
            diagonal = row[k];
            row[k] = std::min({exchanged, row[k] + 1, row[k - 1] + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string one_line(std::string_view text, std::size_t longest) {
    std::string line(text.substr(0, longest));
    if (line.size() < text.size())  // no part of a character at the end
        while (!line.empty() && (static_cast<unsigned char>(line.back()) & 0x80) != 0) line.pop_back();
    for (char& c : line)
        if (is_control(c)) c = ' ';
    return line.size() < text.size() ? line + "..." : line;
}

BadInput::BadInput(std::string_view text) : std::runtime_error(one_line(text, text.size())) {}

std::string counted(std::uint64_t count, std::string_view one) {
    const std::string number = std::to_string(count) + " ";
    if (count == 1) return number + std::string(one);
    if (one.ends_with('y')) return number + std::string(one.substr(0, one.size() - 1)) + "ies";
    return number + std::string(one) + "s";
}

std::string nearest_hint(const std::string& word, const std::vector<std::string>& words) {
    const auto distance = [&word](const std::string& other) { return distance_between(word, other); };
    const auto nearest = std::ranges::min_element(words, {}, distance);
    const bool near = nearest != words.end() && distance(*nearest) <= 1 + word.size() / 3;
    return near ? "; the nearest is " + *nearest : "";
}

}  // namespace app
