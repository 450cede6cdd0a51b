#include "audio/own_orchestra.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "region_text.h"

namespace audio {
namespace {

constexpr std::size_t kLongestOrchestra = 1 << 20;
constexpr int kMostInstruments = 256;       // each is compiled alone where one is wrong
constexpr std::size_t kLongestLine = 4096;  // Csound goes down a sum term by term, and up to its stack's end
constexpr int kMostElseifs = 1000;          // it takes a time that grows with their square

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

/// Opcodes whose memory an argument sets, and that argument's range: a line of at most 10 s, or 64 filters.
struct Bound {
    std::string_view word;
    int argument;  // from 0
    std::string_view low, high;
};
constexpr Bound kBounds[] = {{"delay", 1, "0", "10"},    {"comb", 2, "0", "10"},     {"alpass", 2, "0", "10"},
                             {"vcomb", 3, "0", "10"},    {"valpass", 3, "0", "10"},  {"vco", 5, "0", "10"},
                             {"pluck", 2, "0.1", "1e6"}, {"wgbow", 7, "0.1", "1e6"}, {"tonex", 2, "1", "64"},
                             {"atonex", 2, "1", "64"},   {"resonx", 3, "1", "64"}};
constexpr int kMostBounded = 64;  // of them in an orchestra

constexpr std::string_view kPlain =
    " ;@.,:+-=<>()[]/%^";  // beside words, of a line that declares a parameter
constexpr std::string_view kSigns = "+-*/%^()[],=<>!&|?:'";
/// Behind these a number may be one of two that Csound would compute when it compiles. 1/0 would become the word inf there, which it
/// takes for a variable that nobody made, and crashes. So numbers are given to abs() there, which it computes when a note begins.
constexpr std::string_view kBeforeComputed = "+-*/%^!(['";

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
    return is_digit(word[0]) && word.find_first_not_of("0123456789.eE+-") == word.npos;
}
std::string shown(char c) {
    return c > 0x20 && c < 0x7f ? std::string(1, c) : "a character that is not plain text";
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
        if (comment_) refuse(0, "the end of the file", "*/");
        if (within_) refuse(0, "the end of the file", "endin");
        for (const auto& [name, line] : declared_)
            if (!contains(made_, name) && !contains(taken_, name)) {
                line_ = line;
                refuse(0, "parameters of " + printable(name), "instr " + printable(name) + " in the file");
            }
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
            const std::size_t name = line.find_first_not_of(" \t", 2);
            if (name != line.npos)
                declared_.emplace_back(line.substr(name, line.find_first_of(" \t", name) - name), line_);
            for (const char c : line)
                out_ += is_word(c) || kPlain.find(c) != std::string_view::npos ? c : ' ';
            return;
        }
        if (line.size() > kLongestLine)
            refuse(kLongestLine, "more than " + std::to_string(kLongestLine) + " characters in a line",
                   "fewer: several lines, each with a part");
        previous_ = {};
        depth_ = 0, names_ = false, computed_ = false;
        bound_ = nullptr, argument_ = -1;
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
                while (end < line.size() && (is_word(line[end]) || (is_digit(rest[0]) && goes_on(line, end))))
                    ++end;
                word(line.substr(at, end - at), at);
                at = end;
            } else {
                sign(rest[0], at++);
            }
        }
        end_argument();
        if (depth_ != 0)
            refuse(line.size(), "the end of the line", "the closing parenthesis on the same line");
    }

    /// Of a number that began before it: a point, or the sign of an exponent.
    static bool goes_on(std::string_view line, std::size_t at) {
        const bool exponent = line[at - 1] == 'e' || line[at - 1] == 'E';
        return line[at] == '.' || (exponent && (line[at] == '-' || line[at] == '+'));
    }

    void word(std::string_view word, std::size_t at) {
        if (names_) {
            if (contains(taken_, word) || is_digit(word[0]) || word[0] == '$')
                refuse(at, "instr " + printable(word), "a name that no other instrument has");
            made_.push_back(word);
        } else if (word == "instr") {
            if (within_) refuse(at, "instr", "endin before it");
            if (++instruments_ > kMostInstruments)
                refuse(at, "more than " + std::to_string(kMostInstruments) + " instruments", "fewer");
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
        if (word == "elseif" && ++elseifs_ > kMostElseifs)
            refuse(at, "more than " + std::to_string(kMostElseifs) + " elseif", "fewer");
        begin_argument(word, at);
        previous_ = word;
        const bool constant = is_number(word) || word == "$M_PI";
        if (computed_ && constant)
            out_.append("abs(").append(word) += ')';
        else
            out_ += word == "$CLOSE" ? "$OWN_CLOSE" : word;  // which bounds the note's length
        computed_ = false;
    }

    /// Only `aOut delay aIn, iLength` can be bounded, as commas alone tell an argument's ends.
    void begin_argument(std::string_view word, std::size_t at) {
        if (bound_ != nullptr && argument_ < 0) argument_ = 0;
        const auto* found = std::ranges::find(kBounds, word, &Bound::word);
        if (found == std::end(kBounds)) return;
        if (bound_ != nullptr || depth_ > 0 || !previous_.starts_with('a'))
            refuse(at, std::string(word),
                   "it after the variable that it sets: aOut " + std::string(word) + " ...");
        if (++bounded_ > kMostBounded)
            refuse(at, "more than " + std::to_string(kMostBounded) + " opcodes with memory", "fewer");
        bound_ = found;
    }

    void end_argument() {
        if (bound_ != nullptr && argument_ == bound_->argument)
            out_ += ", " + std::string(bound_->low) + ", " + std::string(bound_->high) + ")";
        bound_ = nullptr;
    }

    void sign(char c, std::size_t at) {
        const bool blank = c == ' ' || c == '\t';
        if (bound_ != nullptr && argument_ < 0 && !blank)
            refuse(at, std::string(bound_->word) + " " + shown(c),
                   "a variable as what it hears: aOut " + std::string(bound_->word) + " aIn, ...");
        if (bound_ != nullptr && c == ',' && depth_ == 0) return comma();
        if (!blank && (!within_ || kSigns.find(c) == std::string_view::npos))
            refuse(at, shown(c), "opcodes and numbers: no texts, labels, or lines of the preprocessor");
        if (c == '=' && (previous_ == "sr" || previous_ == "kr" || previous_ == "ksmps"))
            refuse(at, std::string(previous_) + " =", "the header's values as they are");
        if (c == '(' || c == '[') ++depth_;
        if (c == ')' || c == ']') --depth_;
        if (depth_ < 0) refuse(at, std::string(1, c), "an opening parenthesis before it");
        if (!blank) {
            const bool call =
                c == '(' && !previous_.empty() && previous_[0] != '$' && !is_digit(previous_[0]);
            computed_ = !call && kBeforeComputed.find(c) != std::string_view::npos;
            previous_ = {};
        }
        out_ += blank ? ' ' : c;
    }

    void comma() {
        const Bound* bound = bound_;
        end_argument();
        previous_ = {};
        computed_ = false;
        out_ += ',';
        if (++argument_ > bound->argument) return;
        bound_ = bound;
        if (argument_ == bound->argument) out_ += " limit(";
    }

    std::string_view text_, previous_;
    std::string file_, out_;
    std::span<const std::string> taken_;
    std::vector<std::string_view> made_;                              // instruments
    std::vector<std::pair<std::string_view, std::size_t>> declared_;  // of parameters, and their lines
    std::size_t at_ = 0, line_ = 1;
    int depth_ = 0, instruments_ = 0, bounded_ = 0, elseifs_ = 0;
    bool computed_ = false;         // a number here may be computed with
    const Bound* bound_ = nullptr;  // of the opcode whose arguments are read
    int argument_ = -1;             // -1: none has begun
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
