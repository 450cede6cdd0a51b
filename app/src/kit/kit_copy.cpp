#include "kit/kit_copy.h"

#include <audio/samples.h>
#include <fmt/format.h>
#include <toml++/toml.h>
#include <tracking/input.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "kit/kit.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// A basic string of TOML.
std::string in_toml(const std::string& text) {
    std::string out = "\"";
    for (const char c : text)
        if (c == '"' || c == '\\')
            (out += '\\') += c;
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
        else
            out += c;
    return out + "\"";
}

/// A file's whole path as it is named: what links stand for is copied under their own names.
fs::path whole(const fs::path& file) {
    return fs::absolute(file).lexically_normal();
}

/// Whether a file lies in a folder.
bool lies_in(const fs::path& file, const fs::path& folder) {
    const fs::path relative = whole(file).lexically_relative(whole(folder));
    return !relative.empty() && *relative.begin() != "..";
}

/// The folder that holds all of these files.
fs::path common_folder(const std::vector<fs::path>& files) {
    fs::path common = whole(files.front()).parent_path();
    for (const fs::path& file : files)
        while (!lies_in(file, common)) common = common.parent_path();
    return common;
}

/// A name in a kit's text that stands for a file.
struct NamedFile {
    std::string key;
    const toml::node* name;
};

void collect(const toml::node& node, const std::string& key, std::vector<NamedFile>& found) {
    static const std::set<std::string> kKeys = {"include", "mesh", "samples", "orchestra", "room_impulse"};
    if (node.is_string() && kKeys.contains(key)) found.push_back({key, &node});
    if (const toml::array* array = node.as_array())
        for (const toml::node& entry : *array) collect(entry, key, found);
    if (const toml::table* table = node.as_table())
        for (const auto& [name, entry] : *table) collect(entry, std::string(name.str()), found);
}

/// Where a text's line and column (both from 1, in characters) are.
std::size_t place_in(const std::string& text, const toml::source_position& position) {
    std::size_t at = 0;
    for (std::uint32_t line = 1; line < position.line; ++line) at = text.find('\n', at) + 1;
    for (std::uint32_t column = 1; column < position.column; ++at)
        if ((static_cast<unsigned char>(text[at + 1]) & 0xc0) != 0x80) ++column;  // UTF-8
    return at;
}

class Copier {
public:
    Copier(const Kit& kit, const fs::path& out)
        : kit_(kit), out_(out), folder_(out.parent_path() / (out.stem().string() + "-files")) {}

    /// For what the kit needs.
    [[nodiscard]] const fs::path& folder() const { return folder_; }

    void run() {
        for (const fs::path& file : kit_.files)
            if (!is_defaults(file)) places_[file] = file == kit_.files.front() ? out_ : place_for(file);
        for (const Instrument& instrument : kit_.instruments)
            if (instrument.voice.samples) take_samples(instrument.voice.samples->files);
        for (const auto& [file, place] : places_) texts_[place] = rewritten(file, place);
        for (const auto& [from, to] : copies_) {
            fs::create_directories(to.parent_path());
            write_finished_file(to, tracking::read_bytes(from.string(), "a file of the kit"));
        }
        for (const auto& [place, text] : texts_) {
            if (place != out_) fs::create_directories(place.parent_path());
            write_finished_file(place, text);
        }
    }

private:
    static bool is_defaults(const fs::path& file) {
        return file == assets_folder() / "kits" / "defaults.toml";
    }
    /// A new place of that file's name in the copy's folder.
    fs::path place_for(const fs::path& file) {
        fs::path place = folder_ / file.filename();
        for (int i = 2; !taken_.insert(place.string()).second; ++i)
            place = folder_ / fmt::format("{}-{}{}", file.stem().string(), i, file.extension().string());
        return place;
    }
    fs::path copied(const fs::path& file) {
        const auto known = copies_.find(file);
        return known != copies_.end() ? known->second : copies_[file] = place_for(file);
    }
    /// Samples keep their places to each other.
    void take_samples(const std::vector<fs::path>& files) {
        if (files.empty() || copies_.contains(files.front())) return;
        if (files.size() == 1) {
            (void)copied(files.front());
            return;
        }
        const fs::path from = common_folder(files), to = place_for(files.front().stem());
        for (const fs::path& file : files) copies_[file] = to / whole(file).lexically_relative(from);
    }
    /// The file that a name in a kit's file stands for; empty: a bundled mesh, or none.
    [[nodiscard]] fs::path meant(const fs::path& file, const NamedFile& named) const {
        const std::string name = named.name->value_or(std::string());
        std::error_code error;
        for (const fs::path& folder : {file.parent_path(), kit_.file.parent_path()})
            if (fs::is_regular_file(folder / name, error)) return folder / name;
        const fs::path bundled = assets_folder() / "kits" / name;
        return named.key == "include" && fs::is_regular_file(bundled, error) ? bundled : fs::path();
    }
    /// Where the copy of a file lies: of one that the kit names in another way, too.
    [[nodiscard]] fs::path place_of(const fs::path& file, const std::string& key) {
        const std::map<fs::path, fs::path>& known = key == "include" ? places_ : copies_;
        std::error_code error;
        for (const auto& [from, to] : known)
            if (fs::equivalent(from, file, error)) return to;
        return key == "mesh" || key == "orchestra" || key == "room_impulse" ? copied(file) : fs::path();
    }
    /// The text of a kit's file with the names of its copies.
    std::string rewritten(const fs::path& file, const fs::path& place) {
        std::string text = tracking::read_bytes(file.string(), "a kit (TOML)");
        const toml::table root = toml::parse(text, file.string());
        std::vector<NamedFile> names;
        collect(root, "", names);
        const auto position = [](const NamedFile& named) {
            const toml::source_position& at = named.name->source().begin;
            return std::pair(at.line, at.column);
        };
        std::ranges::sort(names, std::ranges::greater(),
                          position);  // the last one first: places before it stay
        for (const NamedFile& named : names) {
            const fs::path original = meant(file, named);
            const fs::path to = original.empty() ? fs::path() : place_of(original, named.key);
            if (to.empty()) continue;
            const std::size_t begin = place_in(text, named.name->source().begin),
                              end = place_in(text, named.name->source().end);
            const std::string name = to.lexically_relative(place.parent_path()).generic_string();
            text.replace(begin, end - begin, in_toml(name));
        }
        return text;
    }

    const Kit& kit_;
    fs::path out_, folder_;
    std::map<fs::path, fs::path> places_;  ///< of the kit's files
    std::map<fs::path, fs::path> copies_;  ///< of the files that they name
    std::map<fs::path, std::string> texts_;
    std::set<std::string> taken_;
};

}  // namespace

void copy_kit(const fs::path& kit, const fs::path& out) {
    const Kit original = read_kit(kit);
    for (const fs::path& file : original.files)
        if (std::error_code error; fs::equivalent(file, out, error))
            throw BadInput(fmt::format(
                "error: found --out {}, which the kit is read from, expected another file", out.string()));
    const fs::path folder = Copier(original, out).folder();
    if (output_place(folder).kind == OutputPlace::Kind::file)
        throw BadInput(fmt::format(
            "error: found {}, which is a file, expected a folder for what the kit needs", folder.string()));
    (void)output_place(out);
    Copier(original, out).run();
    const Kit copy = read_kit(out);
    for (const fs::path& file : copy.sound_files)
        if (!lies_in(file, fs::absolute(out).parent_path()))
            throw BadInput(
                fmt::format("{}:1:1: error: found {}, which is named by its whole path in another file, "
                            "expected paths relative to that file; the copy is not whole",
                            out.string(), file.string()));
}

}  // namespace app
