#include "sticks/predictors.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "files/assets.h"
#include "files/bad_input.h"
#include "sticks/external_predictor.h"

namespace app {
namespace {

constexpr std::string_view kExternal = "exec:";

// What `auto` stands for, as measured on recorded mallets and sabers (docs/results.md). Pictures want the
// least mean error: a velocity that fades with the lead errs 5 to 25 % less than one that lasts, on every
// recording, and a network errs less where it knows the motion. Strikes want a path that bends: constant acceleration times them best, and the constant
// velocity, which does not overshoot after a rebound, confirms them.
constexpr std::string_view kAuto = "auto", kAutoModel = "auto:model=";
constexpr const char* kAutoPicture = "arbitrated";
constexpr const char* kAutoSound = "ca:q=7e8,gate=5";
constexpr const char* kAutoConfirming = "cv:q=1e8,gate=5";

std::string command_of(const std::string& specification) {
    std::string command = specification.substr(kExternal.size());
    if (command.find_first_not_of(" \t") == std::string::npos)
        throw BadInput(
            fmt::format("error: found predictor \"{}\" without a command, expected exec:CMD such as "
                        "\"exec:python3 mine.py\"",
                        specification));
    return command;
}

constexpr const char* kBundledModel = "general";

bool needs_model(const std::string& name) {
    return name == "learned" || name == "arbitrated";
}

/// The part of a specification that names its model, as [begin, end); none where it names none.
std::optional<std::pair<std::size_t, std::size_t>> model_part(const std::string& specification) {
    constexpr std::string_view kKey = "model=";
    std::size_t key = specification.find(':');
    while (key != std::string::npos && specification.compare(key + 1, kKey.size(), kKey) != 0)
        key = specification.find(',', key + 1);
    if (key == std::string::npos) return std::nullopt;
    const std::size_t begin = key + 1 + kKey.size();
    return std::pair(begin, std::min(specification.find(',', begin), specification.size()));
}

/// With the file of the model that is named, or of the bundled one.
std::string with_model_file(const std::string& specification) {
    const std::string file = model_file(specification)->string();
    if (const auto part = model_part(specification))
        return specification.substr(0, part->first) + file + specification.substr(part->second);
    return fmt::format("{}{}model={}", specification,
                       specification.find(':') == std::string::npos ? ":" : ",", file);
}

std::unique_ptr<tracking::Predictor> make_internal(const std::string& specification,
                                                   const TrackedStick& stick) {
    const std::vector<std::string>& names = tracking::predictor_names();
    const std::string name = specification.substr(0, specification.find(':'));
    if (std::find(names.begin(), names.end(), name) == names.end() && !needs_model(name))
        throw BadInput(fmt::format(
            "error: found predictor \"{}\", expected auto, exec:CMD or one of {}, learned, arbitrated", name,
            fmt::join(names, ", ")));
    try {
        return tracking::make_predictor(needs_model(name) ? with_model_file(specification) : specification,
                                        stick.shaft);
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("error: {}", wrong.what()));
    }
}

/// The end of the part that begins at `begin`: its comma, or the list's end.
std::size_t end_of_part(const std::string& list, std::size_t begin) {
    const bool external = list.compare(begin, kExternal.size(), kExternal) == 0;
    std::size_t end = list.find(',', begin);
    while (external && end != std::string::npos && list[end - 1] == '\\') end = list.find(',', end + 1);
    return std::min(end, list.size());
}

std::string unescaped(std::string part) {
    for (std::size_t at = part.find("\\,"); at != std::string::npos; at = part.find("\\,", at + 1))
        part.erase(at, 1);
    return part;
}

}  // namespace

bool is_auto(const std::string& specification) {
    return specification.substr(0, specification.find(':')) == kAuto;
}

std::optional<std::filesystem::path> model_file(const std::string& specification) {
    if (!needs_model(specification.substr(0, specification.find(':')))) return std::nullopt;
    const auto part = model_part(specification);
    return find_bundled(part ? specification.substr(part->first, part->second - part->first) : kBundledModel,
                        "models", ".model");
}

std::string confirming_specification(const std::string& specification) {
    return is_auto(specification) ? kAutoConfirming : "";
}

std::string picture_specification(const std::string& specification) {
    return is_auto(specification) ? kAutoPicture + specification.substr(kAuto.size()) : specification;
}

std::string sound_specification(const std::string& specification) {
    return is_auto(specification) ? kAutoSound : specification;
}

bool is_external(const std::string& specification) {
    return specification.starts_with(kExternal);
}

std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                        std::span<const double> leads_s,
                                                        const TrackedStick& stick) {
    if (!is_external(specification)) return make_internal(specification, stick);
    return std::make_unique<ExternalPredictor>(command_of(specification), leads_s, stick.name);
}

void check_specification(const std::string& specification) {
    if (is_external(specification)) {
        (void)command_of(specification);
        return;
    }
    if (is_auto(specification) && specification != kAuto &&
        (!specification.starts_with(kAutoModel) || specification.find(',') != std::string::npos))
        throw BadInput(
            fmt::format("error: found predictor \"{}\", expected auto or auto:model=FILE; to set parameters "
                        "say arbitrated:model=FILE,KEY=VALUE",
                        specification));
    (void)make_internal(picture_specification(specification), {});
}

std::vector<std::string> split_specifications(const std::string& list) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= list.size();) {
        const std::size_t end = end_of_part(list, begin);
        std::string part = list.substr(begin, end - begin);
        if (part.empty())
            throw BadInput(fmt::format(
                "error: found an empty name in the list of predictors \"{}\", expected names between commas",
                list));
        const bool continues = !parts.empty() && !is_external(parts.back()) &&
                               part.find('=') != std::string::npos && part.find(':') == std::string::npos;
        if (continues)
            parts.back() += "," + part;
        else
            parts.push_back(is_external(part) ? unescaped(std::move(part)) : std::move(part));
        begin = end + 1;
    }
    return parts;
}

}  // namespace app
