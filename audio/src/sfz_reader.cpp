#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "region_text.h"

namespace audio {
namespace fs = std::filesystem;
namespace {

constexpr int kDeepestInclude = 8;
constexpr std::size_t kMostDefines = 1000, kMostLineAfterDefines = 1 << 14;
constexpr std::size_t kMostOpcodes = 1000;  // of one header

/// What a header says, over the headers above it.
struct Opcode {
    std::string value, place;
};
using Opcodes = std::map<std::string, Opcode, std::less<>>;

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}
std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

std::optional<double> number_of(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
    return value;
}

/// "60", "c4" (60), "c#4", "db4".
std::optional<int> key_of(std::string_view text) {
    if (const auto number = number_of(text)) {
        const bool whole = *number == std::floor(*number) && *number >= -1 && *number <= 127;
        return whole ? std::optional(static_cast<int>(*number)) : std::nullopt;
    }
    constexpr std::string_view kNotes = "c d ef g a b";
    if (text.size() < 2) return {};
    const char letter = static_cast<char>(text[0] | 0x20);
    const std::size_t note = letter == ' ' ? kNotes.npos : kNotes.find(letter);
    text.remove_prefix(1);
    int sharp = 0;
    if (text.front() == '#') sharp = 1;
    if (text.front() == 'b') sharp = -1;
    if (sharp != 0) text.remove_prefix(1);
    const auto octave = number_of(text);
    if (note == kNotes.npos || !octave || *octave != std::floor(*octave) || std::abs(*octave) > 10) return {};
    const int key = static_cast<int>(note) + sharp + 12 * (static_cast<int>(*octave) + 1);
    return key >= 0 && key <= 127 ? std::optional(key) : std::nullopt;
}

/// The text without comments, of which the line breaks stay.
std::string without_comments(std::string_view text) {
    std::string result(text);
    for (std::size_t at = 0; at + 1 < result.size(); ++at) {
        if (result[at] != '/' || (result[at + 1] != '/' && result[at + 1] != '*')) continue;
        const bool line = result[at + 1] == '/';
        const std::size_t found = result.find(line ? "\n" : "*/", at + 2);
        const std::size_t end = found == result.npos ? result.size() : found + (line ? 0 : 2);
        for (; at < end; ++at)
            if (result[at] != '\n') result[at] = ' ';
        --at;
    }
    return result;
}

class SfzReader {
public:
    explicit SfzReader(const fs::path& file) : folder_(file.parent_path()) {}

    void read(std::string_view text, const fs::path& file, int depth) {
        result_.files.push_back(file);
        const std::string clean = without_comments(text);
        std::string_view rest = clean;
        for (int line = 1; !rest.empty(); ++line) {
            const std::size_t length = std::min(rest.find('\n'), rest.size());
            read_line(rest.substr(0, length), {file.string(), line}, depth);
            rest.remove_prefix(std::min(length + 1, rest.size()));
        }
    }
    WrittenRegions finish() {
        end_header();
        result_.ignored.assign(ignored_.begin(), ignored_.end());
        result_.sw_default = sw_default_;
        return std::move(result_);
    }

private:
    struct Place {
        std::string file;
        int line;
        [[nodiscard]] std::string at(std::size_t column) const {
            return file + ":" + std::to_string(line) + ":" + std::to_string(column + 1);
        }
    };
    enum Level { control, global, master, group, region, none };

    void read_line(std::string_view line, const Place& place, int depth) {
        const std::size_t begin = line.size() - trimmed_front(line).size();
        const std::string_view text = line.substr(begin);
        if (text.starts_with("#define")) return define(text.substr(7), place.at(begin));
        if (text.starts_with("#include")) return include(trimmed(text.substr(8)), place.at(begin), depth);
        const std::string whole = with_defines(line, place);
        read_opcodes(whole, place);
    }
    static std::string_view trimmed_front(std::string_view text) {
        while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
        return text;
    }

    void define(std::string_view text, const std::string& place) {
        text = trimmed(text);
        const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
        const std::string_view name = text.substr(0, end), value = trimmed(text.substr(end));
        if (name.size() < 2 || name.front() != '$' || !std::all_of(name.begin() + 1, name.end(), is_word) ||
            value.empty())
            fail_at(place, "#define " + printable(text), "#define $NAME value");
        if (defines_.size() >= kMostDefines)
            fail_at(place, "more than " + std::to_string(kMostDefines) + " #define", "fewer");
        defines_[std::string(name.substr(1))] = value;
    }

    void include(std::string_view name, const std::string& place, int depth) {
        if (name.size() < 3 || name.front() != '"' || name.back() != '"')
            fail_at(place, "#include " + printable(name), "#include \"FILE\"");
        if (depth >= kDeepestInclude || result_.files.size() > 64)
            fail_at(place, "files that include each other, or more than 64", "at most 8 within each other");
        std::string inner(name.substr(1, name.size() - 2));
        std::ranges::replace(inner, '\\', '/');
        const fs::path file = folder_ / inner;
        read(read_region_file(file, place), file, depth + 1);
    }

    /// A line with each $NAME replaced by its value; the longest name that fits is meant.
    [[nodiscard]] std::string with_defines(std::string_view line, const Place& place) const {
        std::string result;
        for (std::size_t at = 0; at < line.size();) {
            if (line[at] != '$') {
                result += line[at++];
                continue;
            }
            const std::string_view rest = line.substr(at + 1);
            const std::string* value = nullptr;
            std::size_t length = 0;
            for (const auto& [name, text] : defines_)
                if (rest.starts_with(name) && name.size() > length) value = &text, length = name.size();
            if (!value)
                fail_at(place.at(at), printable(line.substr(at, 20)), "a name that #define gave a value");
            result += *value;
            at += 1 + length;
            if (result.size() > kMostLineAfterDefines)
                fail_at(place.at(at), "a line of more than 16384 characters", "a shorter one");
        }
        return result;
    }

    void read_opcodes(std::string_view line, const Place& place) {
        std::size_t at = 0;
        const auto skip = [&] {
            while (at < line.size() && is_space(line[at])) ++at;
        };
        for (skip(); at < line.size(); skip()) {
            const std::size_t begin = at;
            if (line[at] == '<') {
                const std::size_t end = line.find('>', at);
                if (end == line.npos) fail_at(place.at(begin), printable(line.substr(at)), "<header>");
                header(line.substr(at + 1, end - at - 1), place.at(begin));
                at = end + 1;
                continue;
            }
            while (at < line.size() && is_word(line[at])) ++at;
            if (at == begin || at >= line.size() || line[at] != '=')
                fail_at(place.at(begin), printable(line.substr(begin)), "<header> or opcode=value");
            const std::string_view name = line.substr(begin, at - begin);
            const std::size_t end = end_of_value(line, ++at);
            opcode(name, trimmed(line.substr(at, end - at)), place.at(begin));
            at = end;
        }
    }
    /// A value ends before the next opcode=, the next header, or with the line: names of files hold spaces.
    static std::size_t end_of_value(std::string_view line, std::size_t begin) {
        for (std::size_t at = begin; at < line.size(); ++at) {
            if (line[at] == '<') return at;
            if (line[at] != '=') continue;
            std::size_t word = at;
            while (word > begin && is_word(line[word - 1])) --word;
            if (word < at && word > begin && is_space(line[word - 1])) return word;
        }
        return line.size();
    }

    void header(std::string_view name, const std::string& place) {
        constexpr std::array<std::string_view, 5> kNames = {"control", "global", "master", "group", "region"};
        end_header();
        const auto found = std::ranges::find(kNames, name);
        level_ = found == kNames.end() ? none : static_cast<Level>(found - kNames.begin());
        if (level_ == none) {  // <curve>, <effect>, <midi> ...
            ignored_.insert("<" + printable(name) + ">");
            return;
        }
        for (int below = level_; level_ != control && below <= region; ++below)
            levels_[static_cast<std::size_t>(below)].clear();
        place_ = place;
    }

    void opcode(std::string_view name, std::string_view value, const std::string& place) {
        if (level_ == none) return;
        if (level_ == control) return control_opcode(name, value, place);
        Opcodes& given = levels_[static_cast<std::size_t>(level_)];
        given[std::string(name)] = {std::string(value), place};
        if (given.size() > kMostOpcodes)
            fail_at(place, "more than " + std::to_string(kMostOpcodes) + " opcodes of one header", "fewer");
    }
    void control_opcode(std::string_view name, std::string_view value, const std::string& place) {
        if (name == "default_path") {
            default_path_ = value;
        } else if (name == "note_offset" || name == "octave_offset") {
            const double keys = required(number_of(value), name, value, place, -127, 127, "keys");
            (name == "note_offset" ? note_offset_ : octave_offset_) = static_cast<int>(keys);
        } else if (name.starts_with("set_cc")) {
            controllers_[std::string(name.substr(6))] =
                required(number_of(value), name, value, place, 0, 127, "a controller's value");
        } else {
            ignored_.insert(std::string(name.substr(0, 60)));
        }
    }

    static double required(std::optional<double> number, std::string_view name, std::string_view value,
                           const std::string& place, double low, double high, const char* what) {
        if (!number || *number < low || *number > high)
            fail_at(place, std::string(name) + "=" + printable(value),
                    std::string(what) + " from " + std::to_string(static_cast<long long>(low)) + " to " +
                        std::to_string(static_cast<long long>(high)));
        return *number;
    }

    /// The region that ends here.
    void end_header() {
        if (level_ != region) return;
        Opcodes all;
        for (const Level level : {region, group, master, global}) {
            Opcodes& given = levels_[level];
            // `key` stands for these three where its level does not say them.
            if (const auto key = given.find("key"); key != given.end()) {
                (void)take_key(key->second, "key");
                for (const char* name : {"lokey", "hikey", "pitch_keycenter"})
                    given.emplace(name, key->second);
            }
            all.insert(given.begin(), given.end());
        }
        levels_[region].clear();
        if (result_.regions.size() >= kMostRegions)
            fail_at(place_, "more than " + std::to_string(kMostRegions) + " regions", "fewer");
        if (const auto made = region_of(all)) result_.regions.push_back(*made);
    }

    std::optional<WrittenRegion> region_of(const Opcodes& all) {
        WrittenRegion r;
        bool sounds = true;
        for (const auto& [name, opcode] : all) sounds = take(r, name, opcode) && sounds;
        if (r.sample.empty()) {
            if (sounds) fail_at(place_, "a <region> without sample", "sample=FILE");
            return {};
        }
        const int shift = note_offset_ + 12 * octave_offset_;
        r.lokey += shift, r.hikey += shift, r.pitch_keycenter += shift;
        if (r.seq_position > r.seq_length)
            fail_at(r.place, "seq_position=" + std::to_string(r.seq_position),
                    "at most seq_length, " + std::to_string(r.seq_length));
        if (r.lovel > r.hivel || r.lorand > r.hirand)
            fail_at(r.place, "a low limit above the high one", "lovel <= hivel and lorand <= hirand");
        if ((r.sw_lolast < 0) != (r.sw_hilast < 0) || r.sw_lolast > r.sw_hilast)
            fail_at(r.place, "sw_lolast and sw_hilast that are no range", "both, sw_lolast <= sw_hilast");
        if (r.loop_start >= 0 && r.loop_end >= 0 && r.loop_start > r.loop_end)
            fail_at(r.place, "loop_start=" + std::to_string(r.loop_start), "at most loop_end");
        if (!sounds || r.hikey < 0) return {};
        return r;
    }

    static LoopMode loop_mode_of(const Opcode& opcode) {
        constexpr std::pair<std::string_view, LoopMode> kModes[] = {{"no_loop", LoopMode::none},
                                                                    {"one_shot", LoopMode::none},
                                                                    {"loop_continuous", LoopMode::continuous},
                                                                    {"loop_sustain", LoopMode::sustain}};
        for (const auto& [name, mode] : kModes)
            if (opcode.value == name) return mode;
        fail_at(opcode.place, "loop_mode=" + printable(opcode.value),
                "no_loop, one_shot, loop_continuous or loop_sustain");
    }
    int take_key(const Opcode& opcode, std::string_view name) const {
        const auto key = key_of(opcode.value);
        if (!key)
            fail_at(opcode.place, std::string(name) + "=" + printable(opcode.value),
                    "a key from 0 to 127, or c-1 to g9");
        return *key;
    }

    struct NumberOpcode {
        std::string_view name;
        double WrittenRegion::*value;
        double low, high;
    };
    struct WholeOpcode {
        std::string_view name;
        int WrittenRegion::*value;
        int low, high;
    };

    /// False: the region does not answer a stroke (a release trigger, another controller's range).
    bool take(WrittenRegion& r, const std::string& name, const Opcode& opcode) {
        static constexpr std::array<NumberOpcode, 16> kNumbers = {{
            {"volume", &WrittenRegion::volume, -144, 48},
            {"pan", &WrittenRegion::pan, -100, 100},
            {"amplitude", &WrittenRegion::amplitude, 0, 1000},
            {"amp_veltrack", &WrittenRegion::amp_veltrack, -100, 100},
            {"tune", &WrittenRegion::tune, -9600, 9600},
            {"pitch", &WrittenRegion::tune, -9600, 9600},
            {"transpose", &WrittenRegion::transpose, -127, 127},
            {"pitch_keytrack", &WrittenRegion::pitch_keytrack, -1200, 1200},
            {"lorand", &WrittenRegion::lorand, 0, 1},
            {"hirand", &WrittenRegion::hirand, 0, 1},
            {"delay", &WrittenRegion::delay, 0, 10},
            {"ampeg_delay", &WrittenRegion::ampeg_delay, 0, 100},
            {"ampeg_attack", &WrittenRegion::ampeg_attack, 0, 100},
            {"ampeg_hold", &WrittenRegion::ampeg_hold, 0, 100},
            {"ampeg_decay", &WrittenRegion::ampeg_decay, 0, 100},
            {"ampeg_release", &WrittenRegion::ampeg_release, 0, 100},
        }};
        static constexpr std::array<WholeOpcode, 6> kWholes = {{
            {"lovel", &WrittenRegion::lovel, 0, 127},
            {"hivel", &WrittenRegion::hivel, 0, 127},
            {"seq_length", &WrittenRegion::seq_length, 1, 1000},
            {"seq_position", &WrittenRegion::seq_position, 1, 1000},
            {"group", &WrittenRegion::group, -2147483647, 2147483647},
            {"off_by", &WrittenRegion::off_by, -2147483647, 2147483647},
        }};
        const auto number = [&](double low, double high) {
            return required(number_of(opcode.value), name, opcode.value, opcode.place, low, high, "a number");
        };
        const auto whole = [&](double low, double high) {
            const double value = number(low, high);
            if (value != std::floor(value))
                fail_at(opcode.place, name + "=" + printable(opcode.value), "a whole number");
            return value;
        };
        if (const auto found = std::ranges::find(kNumbers, name, &NumberOpcode::name);
            found != kNumbers.end()) {
            r.*found->value = number(found->low, found->high);
        } else if (const auto known = std::ranges::find(kWholes, name, &WholeOpcode::name);
                   known != kWholes.end()) {
            r.*known->value = static_cast<int>(whole(known->low, known->high));
        } else if (name == "ampeg_sustain") {
            r.ampeg_sustain = number(0, 100);
        } else if (name == "offset") {
            r.offset = static_cast<std::int64_t>(whole(0, 4294967296.0));
        } else if (name == "end") {
            r.end = static_cast<std::int64_t>(whole(-1, 4294967296.0));
            return r.end >= 0;  // end = -1 silences a region
        } else if (name == "sample") {
            std::string path = default_path_ + opcode.value;
            std::ranges::replace(path, '\\', '/');
            if (path.starts_with('*'))
                fail_at(opcode.place, "sample=" + printable(opcode.value), "a file: generators are not made");
            r.sample = folder_ / path;
            r.place = opcode.place;
        } else if (name == "lokey") {
            r.lokey = take_key(opcode, name);
        } else if (name == "hikey") {
            r.hikey = take_key(opcode, name);
        } else if (name == "pitch_keycenter") {
            r.pitch_keycenter = opcode.value == "sample" ? 60 : take_key(opcode, name);
        } else if (name == "loop_mode" || name == "loopmode") {
            r.loop_mode = loop_mode_of(opcode);
        } else if (name == "loop_start" || name == "loopstart") {
            r.loop_start = static_cast<std::int64_t>(whole(0, 4294967296.0));
        } else if (name == "loop_end" || name == "loopend") {
            r.loop_end = static_cast<std::int64_t>(whole(0, 4294967296.0));
        } else if (name == "sw_default") {
            sw_default_ = take_key(opcode, name);
        } else if (name == "sw_last") {
            r.sw_lolast = r.sw_hilast = take_key(opcode, name);
        } else if (name == "sw_lolast") {
            r.sw_lolast = take_key(opcode, name);
        } else if (name == "sw_hilast") {
            r.sw_hilast = take_key(opcode, name);
        } else if (name == "sw_lokey" || name == "sw_hikey" || name == "sw_up") {
            (void)take_key(opcode, name);
        } else if (name == "sw_down" || name == "sw_previous") {
            (void)take_key(opcode, name);
            return false;  // no other key is down, none was before
        } else if (name == "trigger") {
            return opcode.value == "attack" || opcode.value == "first";
        } else if (name.starts_with("locc") || name.starts_with("hicc")) {
            const auto controller = controllers_.find(name.substr(4));
            const double value = controller == controllers_.end() ? 0 : controller->second;
            return name.starts_with("lo") ? value >= number(0, 127) : value <= number(0, 127);
        } else if (name != "key") {
            ignored_.insert(name.substr(0, 60));
        }
        return true;
    }

    fs::path folder_;
    WrittenRegions result_;
    std::array<Opcodes, 5> levels_;
    Level level_ = none;
    std::string place_, default_path_;
    int note_offset_ = 0, octave_offset_ = 0, sw_default_ = -1;
    std::map<std::string, std::string> defines_;
    std::map<std::string, double> controllers_;
    std::set<std::string> ignored_;
};

}  // namespace

WrittenRegions parse_sfz(std::string_view text, const fs::path& file) {
    SfzReader reader(file);
    reader.read(text, file, 0);
    WrittenRegions written = reader.finish();
    if (written.regions.empty())
        fail_at(file.string() + ":1:1", "no <region> that a stroke sounds", "at least one");
    return written;
}

}  // namespace audio
