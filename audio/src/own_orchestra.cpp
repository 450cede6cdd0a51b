#include "audio/own_orchestra.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

#include "region_text.h"

namespace audio {
namespace {

constexpr std::size_t kLongestOrchestra = 1 << 20;

/// Opcodes that reach files by number, other processes, networks, devices or clocks. Those that need a text can do nothing
/// without one, and are named where their message is clearer so.
constexpr std::array<std::string_view, 62> kRefused = {
    "adsyn",      "convolve",    "ctrlsave",  "cuserrnd",    "date",       "dates",       "diskgrain",
    "diskin",     "diskin2",     "evalstr",   "exitnow",     "ficlose",    "filebit",     "filelen",
    "filenchnls", "filepeak",    "filesr",    "filevalid",   "fin",        "fini",        "fink",
    "fiopen",     "ftaudio",     "ftload",    "ftloadk",     "ftsave",     "ftsavek",     "getcfg",
    "insglobal",  "insremot",    "lpread",    "midglobal",   "midremot",   "midiout",     "midiout_i",
    "pconvolve",  "pvoc",        "pvsdiskin", "pvsfread",    "pvsfwrite",  "pwd",         "readclock",
    "readf",      "readfi",      "readscore", "readscratch", "remoteport", "remove",      "rtclock",
    "scoreline",  "scoreline_i", "sndload",   "soundin",     "soundout",   "soundouts",   "strecv",
    "stsend",     "system",      "system_i",  "systime",     "vpvoc",      "writescratch"};
constexpr std::array<std::string_view, 13> kRefusedBeginnings = {
    "ATS", "OSC", "arduino", "compile", "dumpk", "fout", "hrtf",
    "mp3", "pvb", "readk",   "serial",  "sf",    "sock"};
constexpr std::array<std::string_view, 4> kHeader = {"sr", "ksmps", "nchnls", "0dbfs"};
constexpr std::array<std::string_view, 3> kTableMakers = {"ftgen", "ftgenonce", "ftgentmp"};
constexpr std::array<int, 5> kFileGens = {1, 23, 28, 43, 49};

struct Token {
    std::string_view text;
    std::size_t line, column;
};

bool contains(const auto& words, std::string_view word) {
    return std::ranges::find(words, word) != words.end();
}

class Check {
public:
    Check(std::string_view text, const std::string& file) : text_(text), file_(file) { split(); }

    void run(std::span<const std::string> taken) const {
        for (std::size_t i = 0; i < tokens_.size(); ++i) {
            const std::string_view word = tokens_[i].text;
            const std::string_view next = i + 1 < tokens_.size() ? tokens_[i + 1].text : "";
            if (contains(kRefused, word) || starts_refused(word))
                refuse_token(i, "opcode " + printable(word),
                             "opcodes that make sound: no files, network or processes");
            if (contains(kHeader, word) && next == "=" && (i == 0 || tokens_[i - 1].line < tokens_[i].line))
                refuse_token(i, printable(word) + " =",
                             "instruments only: the header is the bundled orchestra's");
            if (contains(kTableMakers, word)) check_table(i);
            if (word == "instr") check_names(i, taken);
        }
    }

private:
    static bool starts_refused(std::string_view word) {
        return std::ranges::any_of(kRefusedBeginnings,
                                   [&](std::string_view start) { return word.starts_with(start); });
    }
    [[noreturn]] void refuse_token(std::size_t i, const std::string& found,
                                   const std::string& expected) const {
        refuse_at(tokens_[i].line, tokens_[i].column, found, expected);
    }
    [[noreturn]] void refuse_at(std::size_t line, std::size_t column, const std::string& found,
                                const std::string& expected) const {
        fail_at(file_ + ":" + std::to_string(line) + ":" + std::to_string(column), found, expected);
    }

    /// Words and single signs; comments left out.
    void split() {
        std::size_t line = 1, begin = 0;
        for (std::size_t at = 0; at < text_.size();) {
            const char c = text_[at];
            const std::string_view rest = text_.substr(at);
            if (c == '\n') {
                ++line, begin = ++at;
            } else if (c == ';' || rest.starts_with("//")) {
                at = std::min(text_.find('\n', at), text_.size());
            } else if (rest.starts_with("/*")) {
                const std::size_t end = std::min(text_.find("*/", at + 2), text_.size());
                for (; at < std::min(end + 2, text_.size()); ++at)
                    if (text_[at] == '\n') ++line, begin = at + 1;
            } else if (is_word(c) || c == '$') {
                std::size_t end = at + 1;
                while (end < text_.size() && is_word(text_[end])) ++end;
                if (c == '$' && end < text_.size() && text_[end] == '.')
                    refuse_at(line, at - begin + 1, printable(text_.substr(at, end - at + 1)),
                              "$MACRO without a dot");
                tokens_.push_back({text_.substr(at, end - at), line, at - begin + 1});
                at = end;
            } else {
                const auto code = static_cast<unsigned char>(c);
                if (c == '"' || c == '#' || c == '\\' || rest.starts_with("{{") || c == '`')
                    refuse_at(line, at - begin + 1, std::string(1, c),
                              "no texts, macros or lines of the preprocessor of its own");
                if ((code < 0x20 && c != '\t' && c != '\r') || code >= 0x7f)
                    refuse_at(line, at - begin + 1, "a character that is not plain text",
                              "ASCII outside comments");
                if (c != ' ' && c != '\t' && c != '\r')
                    tokens_.push_back({text_.substr(at, 1), line, at - begin + 1});
                ++at;
            }
        }
    }

    /// The GEN routine stands as a plain number, and reads no file.
    void check_table(std::size_t i) const {
        std::size_t at = i + 1, depth = 0, commas = 0;
        if (at < tokens_.size() && tokens_[at].text == "(") ++at;
        for (; at < tokens_.size() && commas < 3; ++at) {
            const std::string_view word = tokens_[at].text;
            if (tokens_[at].line != tokens_[i].line) break;
            if (word == "(" || word == "[") ++depth;
            if ((word == ")" || word == "]") && depth > 0) --depth;
            if (word == "," && depth == 0) ++commas;
        }
        if (commas == 3 && at < tokens_.size() && tokens_[at].text == "-") ++at;
        int routine = 0;
        if (commas == 3 && at + 1 < tokens_.size()) {
            const std::string_view word = tokens_[at].text;
            const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), routine);
            if (error != std::errc() || end != word.data() + word.size() || tokens_[at + 1].text != ",")
                routine = 0;
        }
        if (routine <= 0 || std::ranges::find(kFileGens, routine) != kFileGens.end())
            refuse_token(i, printable(tokens_[i].text),
                         "a GEN number that reads no file, as in `ftgen 0, 0, 1024, 10, 1`, on one line");
    }

    void check_names(std::size_t i, std::span<const std::string> taken) const {
        for (std::size_t at = i + 1; at < tokens_.size() && tokens_[at].line == tokens_[i].line; ++at) {
            const std::string_view name = tokens_[at].text;
            if (contains(taken, name) || (name.front() >= '0' && name.front() <= '9'))
                refuse_token(at, "instr " + printable(name),
                             "a name that the bundled orchestra does not have");
        }
    }

    std::string_view text_;
    std::string file_;
    std::vector<Token> tokens_;
};

}  // namespace

void check_own_orchestra(std::string_view text, const std::string& file, std::span<const std::string> taken) {
    if (text.size() > kLongestOrchestra) fail_at(file + ":1:1", "more than 1 MiB", "an orchestra");
    Check(text, file).run(taken);
}

std::string read_own_orchestra(const std::filesystem::path& file, std::span<const std::string> taken) {
    std::string text = read_region_file(file);
    check_own_orchestra(text, file.string(), taken);
    return text;
}

}  // namespace audio
