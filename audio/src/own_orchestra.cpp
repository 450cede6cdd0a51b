#include "audio/own_orchestra.h"

#include <algorithm>
#include <array>
#include <vector>

#include "region_text.h"

namespace audio {
namespace {

constexpr std::size_t kLongestOrchestra = 1 << 20;

/// All words that stand for something else than a number, a variable of its own or an instrument's name: a list of what may be,
/// since Csound has some two thousand opcodes, of which new ones may reach files, processes, networks or clocks. No tables are made or
/// written, as the bundled instruments and the host read theirs; no generators that notes share. No loops, so that a note's work is bounded by its text.
constexpr std::array<std::string_view, 128> kWords = {
    // syntax, casts and the header's values
    "instr", "endin", "if", "then", "else", "elseif", "endif", "a", "k", "i", "init", "sr", "kr", "ksmps",
    "turnoff",
    // of the bundled orchestra: what STROKE sets and CLOSE reads, its opcodes and the host's
    "amid", "aside", "asilence", "aforce", "acontact", "arough", "iduration", "ilevel", "iwidth", "iplace",
    "ispeed", "iseed", "icontact", "iarea", "ilouder", "iaside", "ktime", "Level", "Contact", "Reaches",
    "Seed", "Scatter", "Duration", "contact_force", "noise_burst", "$STROKE", "$CLOSE", "$M_PI",
    // envelopes
    "line", "linseg", "linsegb", "expon", "expseg", "expsegb", "cosseg", "linen", "adsr", "madsr", "xadsr",
    "transeg", "timeinsts", "timeinstk",
    // sources
    "oscils", "phasor", "buzz", "gbuzz", "pluck", "wgbow", "mpulse", "vco",
    // filters and delays
    "tone", "tonek", "tonex", "atone", "atonek", "atonex", "butterlp", "butterhp", "butterbp", "butterbr",
    "butlp", "buthp", "butbp", "butbr", "reson", "resonk", "resonr", "resonx", "resonz", "areson", "mode",
    "lowpass2", "lowres", "biquad", "pareq", "rbjeq", "moogladder", "svfilter", "streson", "comb", "vcomb",
    "alpass", "valpass", "delay", "delay1", "dcblock", "dcblock2", "port", "portk", "interp", "upsamp",
    "downsamp", "integ", "diff", "clip", "balance", "rms", "gain", "follow", "limit",
    // functions
    "abs", "exp", "log", "log2", "log10", "sqrt", "sin", "cos"};
constexpr std::array<std::string_view, 21> kMoreWords = {
    "tan",   "sinh", "cosh", "tanh", "sininv", "cosinv", "taninv", "taninv2", "int",  "frac",  "round",
    "floor", "ceil", "min",  "max",  "pow",    "mod",    "ampdb",  "dbamp",   "cent", "octave"};
constexpr std::string_view kPlain =
    " ;@.,:+-=<>()[]/%^";  // beside words, of a line that declares a parameter
constexpr std::string_view kSigns = "+-*/%^()[],=<>!&|?:'";

bool contains(const auto& words, std::string_view word) {
    return std::ranges::find(words, word) != words.end();
}
bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// a, k or i and then a capital letter, a digit or a line: no opcode is called so.
bool is_variable(std::string_view word) {
    return word.size() > 1 && (word[0] == 'a' || word[0] == 'k' || word[0] == 'i') &&
           (is_digit(word[1]) || word[1] == '_' || (word[1] >= 'A' && word[1] <= 'Z'));
}
bool is_number(std::string_view word) {
    return is_digit(word[0]) &&
           std::ranges::all_of(word, [](char c) { return is_digit(c) || c == '.' || c == 'e' || c == 'E'; });
}
bool is_p_field(std::string_view word) {
    return word.size() > 1 && word[0] == 'p' && std::ranges::all_of(word.substr(1), is_digit);
}

/// Reads the text line by line and writes what Csound gets: the same lines without their comments, but for those that declare
/// parameters, which stand between instruments. So Csound sees nothing that was not seen here.
class Check {
public:
    Check(std::string_view text, const std::string& file, std::span<const std::string> taken)
        : text_(text), file_(file), taken_(taken) {}

    std::string run() {
        while (at_ < text_.size()) {
            const std::size_t end = std::min(text_.find('\n', at_), text_.size());
            line_of(text_.substr(at_, end - at_));
            out_ += '\n';
            at_ = end + 1, ++line_;
        }
        if (within_) refuse(0, "the end of the file", "endin");
        return std::move(out_);
    }

private:
    [[noreturn]] void refuse(std::size_t column, const std::string& found,
                             const std::string& expected) const {
        fail_at(file_ + ":" + std::to_string(line_) + ":" + std::to_string(column + 1), found, expected);
    }

    void line_of(std::string_view line) {
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        if (!comment_ && !within_ && line.starts_with(";@")) {
            for (const char c : line)
                out_ += is_word(c) || kPlain.find(c) != std::string_view::npos ? c : ' ';
            return;
        }
        previous_ = {};
        depth_ = 0, names_ = false;
        for (std::size_t at = 0; at < line.size();) {
            const std::string_view rest = line.substr(at);
            if (comment_) {
                const std::size_t end = line.find("*/", at);
                comment_ = end == std::string_view::npos;
                at = comment_ ? line.size() : end + 2;
                out_ += ' ';
            } else if (rest.starts_with("/*")) {
                comment_ = true, at += 2;
            } else if (rest[0] == ';' || rest.starts_with("//")) {
                break;
            } else if (is_word(rest[0]) || rest[0] == '$') {
                std::size_t end = at + 1;
                while (end < line.size() && (is_word(line[end]) || (line[end] == '.' && is_digit(rest[0]))))
                    ++end;
                word(line.substr(at, end - at), at);
                at = end;
            } else {
                sign(rest[0], at++);
            }
        }
        if (depth_ != 0)
            refuse(line.size(), "the end of the line", "the closing parenthesis on the same line");
    }

    void word(std::string_view word, std::size_t at) {
        if (names_) {
            if (contains(taken_, word) || is_digit(word[0]) || word[0] == '$')
                refuse(at, "instr " + printable(word), "a name that no other instrument has");
        } else if (word == "instr") {
            if (within_) refuse(at, "instr", "endin before it");
            within_ = names_ = true;
        } else if (!within_) {
            refuse(at, printable(word), "instruments only: instr NAME ... endin");
        } else if (word == "endin") {
            within_ = false;
        } else if (word == "p1" || word == "p2" || word == "p3") {
            refuse(at, std::string(word),
                   "iduration for a note's length, which $CLOSE sets; p4 and on are the note's");
        } else if (!contains(kWords, word) && !contains(kMoreWords, word) && !is_variable(word) &&
                   !is_number(word) && !is_p_field(word)) {
            refuse(
                at, printable(word),
                "an opcode that makes sound, or a variable: a, k or i and then a capital letter or a digit");
        }
        previous_ = word;
        out_ += word == "$CLOSE" ? "$OWN_CLOSE" : word;  // which bounds the note's length
    }

    void sign(char c, std::size_t at) {
        const bool blank = c == ' ' || c == '\t';
        if (!blank && (!within_ || kSigns.find(c) == std::string_view::npos))
            refuse(at, c > 0x20 && c < 0x7f ? std::string(1, c) : "a character that is not plain text",
                   "opcodes and numbers: no texts, labels, or lines of the preprocessor");
        if (c == '=' && (previous_ == "sr" || previous_ == "kr" || previous_ == "ksmps"))
            refuse(at, std::string(previous_) + " =", "the header's values as they are");
        if (c == '(' || c == '[') ++depth_;
        if (c == ')' || c == ']') --depth_;
        if (depth_ < 0) refuse(at, std::string(1, c), "an opening parenthesis before it");
        if (!blank) previous_ = {};
        out_ += blank ? ' ' : c;
    }

    std::string_view text_, previous_;
    std::string file_, out_;
    std::span<const std::string> taken_;
    std::size_t at_ = 0, line_ = 1;
    int depth_ = 0;
    bool within_ = false, names_ = false, comment_ = false;
};

}  // namespace

std::string checked_own_orchestra(std::string_view text, const std::string& file,
                                  std::span<const std::string> taken) {
    if (text.size() > kLongestOrchestra) fail_at(file + ":1:1", "more than 1 MiB", "an orchestra");
    return Check(text, file, taken).run();
}

std::string read_own_orchestra(const std::filesystem::path& file, std::span<const std::string> taken) {
    return checked_own_orchestra(read_region_file(file), file.string(), taken);
}

}  // namespace audio
