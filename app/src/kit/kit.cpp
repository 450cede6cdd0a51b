#include "kit/kit.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/toml_reader.h"
#include "kit/kit_keys.h"

namespace app {
namespace fs = std::filesystem;
namespace {

/// The files of a kit, the kit itself first, then its includes in order, the assets' defaults last.
struct KitFiles {
    std::vector<TomlFile> documents;
    std::vector<fs::path> files;
    std::vector<KitHeader> headers;
};

bool is_file(const fs::path& path) {
    std::error_code error;  // a name that is no path (too long) is no file
    return fs::is_regular_file(path, error);
}

/// The file of that name beside the kit or in a folder of bundled ones.
fs::path find_file(const Fields& at, const char* key, const fs::path& name, const fs::path& kit,
                   const char* bundled) {
    const fs::path beside = kit.parent_path() / name, other = assets_folder() / bundled / name;
    const bool found = is_file(beside);
    at.require(found || is_file(other), key, fmt::format("{} \"{}\", which is no file", key, name.string()),
               fmt::format("a file beside {} or among the bundled {}", kit.filename().string(), bundled));
    return found ? beside : other;
}

void load(KitFiles& kit, const fs::path& file) {
    if (std::find(kit.files.begin(), kit.files.end(), file) != kit.files.end()) return;
    if (kit.files.size() > 32)
        throw BadInput(
            fmt::format("{}: error: found more than 32 included files, expected fewer", file.string()));
    std::vector<TomlFile> alone;
    alone.emplace_back(file, TomlKind{"a kit", "`musicworld kit list` names the bundled ones"});
    KitHeader header{file.stem().string(), {}, {}};
    std::vector<fs::path> includes;
    const auto read_header = [&](Fields& keys) {
        header_keys(keys, header);
        for (const std::string& name : header.include)
            includes.push_back(find_file(keys, "include", name, file, "kits"));
    };
    read_toml(alone, "the kit", read_header, false);
    kit.documents.push_back(std::move(alone.front()));
    kit.files.push_back(file);
    kit.headers.push_back(header);
    for (const fs::path& include : includes) load(kit, include);
}

void check_count(const Kit& kit) {
    const std::string file = kit.file.string();
    if (kit.instruments.empty())
        throw BadInput(fmt::format("{}:1:1: error: found no [[instrument]], expected at least one", file));
    if (kit.instruments.size() > 64)
        throw BadInput(fmt::format("{}:1:1: error: found {} instruments, expected at most 64", file,
                                   kit.instruments.size()));
}

}  // namespace

Kit read_kit(const fs::path& file) {
    KitFiles files;
    load(files, file);
    load(files, assets_folder() / "kits" / "defaults.toml");

    KitDraft written;
    written.orchestra = audio::read_instruments(assets_folder() / "orchestra" / "musicworld.orc");
    written.take_stick = [&](Fields& at, StickDefinition& stick) {
        stick.mesh = find_file(at, "mesh", stick.mesh, file, "meshes");
    };
    Kit& kit = written.kit;
    std::set<std::string> names;
    written.take_instrument = [&](Fields& at, Instrument& instrument) {
        instrument.body.name = instrument.name;
        instrument.body.stick_mass_kg = kit.stick.mass_kg;
        instrument.mesh = find_file(at, "mesh", instrument.mesh, file, "meshes");
        at.require(names.insert(instrument.name).second, "",
                   fmt::format("a second instrument \"{}\"", instrument.name), "a name of its own");
        kit.instruments.push_back(instrument);
    };
    kit.file = file;
    kit.files = files.files;
    read_toml(files.documents, "the kit", [&](Fields& keys) { kKitFile.keys(keys, written); });
    kit.name = files.headers.front().name;
    kit.description = files.headers.front().description;
    check_count(kit);
    return kit;
}

FormatDescription kit_format() {
    KitDraft written;
    std::vector<TomlFile> defaults;
    defaults.emplace_back(assets_folder() / "kits" / "defaults.toml", TomlKind{"the kits' defaults", ""});
    written.take_stick = [](Fields&, StickDefinition&) {};
    written.take_instrument = [](Fields&, Instrument&) {};
    read_toml(defaults, "the kits' defaults", [&](Fields& keys) { kKitFile.keys(keys, written); });
    return describe_format(kKitFile, written);
}

}  // namespace app
