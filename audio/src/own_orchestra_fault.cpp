#include <algorithm>
#include <stdexcept>
#include <vector>

#include "audio/own_orchestra.h"
#include "csound_engine.h"
#include "region_text.h"

namespace audio {
namespace {

std::vector<std::string> lines_of(std::string_view text) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t length = std::min(text.find('\n'), text.size());
        lines.emplace_back(text.substr(0, length));
        text.remove_prefix(std::min(length + 1, text.size()));
    }
    return lines;
}

std::string first_word(std::string_view line) {
    const auto begin = std::find_if(line.begin(), line.end(), is_word);
    return {begin, std::find_if_not(begin, line.end(), is_word)};
}

/// What Csound says of an orchestra that it does not compile, from its first error on; empty: nothing.
std::string complaint_of(const std::string& orchestra) {
    try {
        const CsoundEngine engine(orchestra, "");
        return {};
    } catch (const std::runtime_error& refused) {
        const std::string text = refused.what();
        const std::size_t begin = text.find("rror:");
        const std::string rest = begin == std::string::npos ? text : text.substr(begin + 5);
        const std::size_t end =
            std::min({rest.find(" Line"), rest.find(" line"), rest.find("Parsing"), rest.find("(token")});
        std::string plain = rest.substr(0, end);
        std::replace_if(
            plain.begin(), plain.end(), [](char c) { return c < 0x20 || c > 0x7e; }, ' ');
        plain.erase(0, plain.find_first_not_of(' '));
        return plain.empty() ? "an error" : plain;
    }
}

/// Lines from the first on, made an instrument; `close`: with the ends of open conditions.
std::string closed(const std::vector<std::string>& lines, std::size_t first, std::size_t end, bool close) {
    std::string text;
    int open = 0;
    for (std::size_t i = first; i < end; ++i) {
        const std::string word = first_word(lines[i]);
        if (word == "if") ++open;
        if (word == "endif") --open;
        text += lines[i] + "\n";
    }
    for (; open > 0 && close; --open) text += "endif\n";
    return text + "endin\n";
}

}  // namespace

void compile_own_orchestra(const std::string& bundled, const std::string& checked, const std::string& file) {
    const std::string all = complaint_of(bundled + "\n" + checked);
    if (all.empty()) return;
    const auto fail = [&](std::size_t line, const std::string& complaint) {
        fail_at(file + ":" + std::to_string(line + 1) + ":1", "what Csound refuses: " + complaint,
                "lines that it compiles");
    };
    const std::vector<std::string> lines = lines_of(checked);
    for (std::size_t begin = 0; begin < lines.size(); ++begin) {
        if (first_word(lines[begin]) != "instr") continue;
        std::size_t end = begin + 1;
        while (end < lines.size() && first_word(lines[end]) != "endin") ++end;
        const auto complaint = [&](std::size_t last) {
            return complaint_of(bundled + "\n" + closed(lines, begin, last, last < end));
        };
        if (complaint(end).empty()) continue;
        std::size_t good = begin + 1, bad = end;  // lines up to `good` compile
        if (!complaint(good).empty()) fail(begin, complaint(good));
        while (bad > good + 1) {
            const std::size_t middle = good + (bad - good) / 2;
            (complaint(middle).empty() ? good : bad) = middle;
        }
        fail(bad - 1, complaint(bad));
    }
    fail(0, all);
}

}  // namespace audio
