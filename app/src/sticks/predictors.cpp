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
constexpr std::string_view kAuto = "auto";
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

bool needs_model(const std::string& specification) {
    return std::ranges::count(tracking::model_predictor_names(),
                              specification.substr(0, specification.find(':'))) > 0;
}

/// A specification without the file of its model, and that file, if it names one.
struct PartedSpecification {
    std::string rest;
    std::optional<std::string> model = {};
};

/// Where ",KEY=" begins, or the end.
std::size_t end_of_value(const std::string& specification, std::size_t from) {
    for (std::size_t comma = specification.find(',', from); comma != std::string::npos;
         comma = specification.find(',', comma + 1)) {
        const std::size_t end =
            specification.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789", comma + 1);
        if (end != std::string::npos && end > comma + 1 && specification[end] == '=') return comma;
    }
    return specification.size();
}

/// The file's name may hold commas.
PartedSpecification part_model(const std::string& specification) {
    constexpr std::string_view kKey = "model=";
    std::size_t key = specification.find(':');
    while (key != std::string::npos && specification.compare(key + 1, kKey.size(), kKey) != 0)
        key = specification.find(',', key + 1);
    if (key == std::string::npos) return {specification};
    const std::size_t begin = key + 1 + kKey.size(), end = end_of_value(specification, begin);
    std::string rest = specification.substr(0, key);
    if (end < specification.size()) rest += specification[key] + specification.substr(end + 1);
    return {rest, specification.substr(begin, end - begin)};
}

std::unique_ptr<tracking::Predictor> make_internal(const std::string& specification,
                                                   const Eigen::Vector3d& shaft,
                                                   std::shared_ptr<const tracking::PathModel> model) {
    try {
        return tracking::make_predictor(specification, shaft, std::move(model));
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("error: {}", wrong.what()));
    }
}

void check_name(const std::string& specification) {
    const std::string name = specification.substr(0, specification.find(':'));
    const std::vector<std::string>&names = tracking::predictor_names(),
          &of_model = tracking::model_predictor_names();
    if (std::ranges::count(names, name) > 0 || std::ranges::count(of_model, name) > 0) return;
    std::vector<std::string> all = {"auto"};
    all.insert(all.end(), names.begin(), names.end());
    all.insert(all.end(), of_model.begin(), of_model.end());
    throw BadInput(fmt::format("error: found predictor \"{}\", expected auto, exec:CMD or one of {}, {}{}",
                               name, fmt::join(names, ", "), fmt::join(of_model, ", "),
                               nearest_hint(name, all)));
}

/// The end of the part that begins at `begin`: its comma, or the list's end.
std::size_t end_of_part(const std::string& list, std::size_t begin) {
    std::size_t end = list.find(',', begin);
    while (end != std::string::npos && end > begin && list[end - 1] == '\\') end = list.find(',', end + 1);
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
    if (!needs_model(specification)) return std::nullopt;
    const std::string model = part_model(specification).model.value_or(kBundledModel);
    if (model.empty())
        throw BadInput(
            fmt::format("error: found no file behind model= in predictor \"{}\", expected "
                        "model=FILE; without it the bundled one is used",
                        specification));
    return find_bundled(model, "models", ".model");
}

std::shared_ptr<const tracking::PathModel> contact_model(const std::string& specification) {
    if (!is_auto(specification)) return {};
    const std::optional<std::filesystem::path> file = model_file(picture_specification(specification));
    if (!file) return {};
    auto model = std::make_shared<const tracking::PathModel>(tracking::read_path_model(*file));
    return model->contacts ? model : nullptr;
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

PredictorMaker::PredictorMaker(const std::string& specification,
                               std::shared_ptr<const tracking::PathModel> model)
    : specification_(specification), model_(std::move(model)) {
    if (is_external(specification) || model_) return;
    check_name(specification);
    if (const std::optional<std::filesystem::path> file = model_file(specification)) {
        specification_ = part_model(specification).rest;
        model_ = std::make_shared<const tracking::PathModel>(tracking::read_path_model(*file));
    }
}

std::unique_ptr<tracking::Predictor> PredictorMaker::make(std::span<const double> leads_s,
                                                          const TrackedStick& stick) const {
    if (is_external(specification_))
        return std::make_unique<ExternalPredictor>(command_of(specification_), leads_s, stick.name);
    std::unique_ptr<tracking::Predictor> predictor = make_internal(specification_, stick.shaft, model_);
    if (model_) tracking::begin_with_trust(*predictor, *model_, stick.name);
    return predictor;
}

std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                        std::span<const double> leads_s,
                                                        const TrackedStick& stick) {
    return PredictorMaker(specification).make(leads_s, stick);
}

void check_specification(const std::string& specification) {
    if (is_external(specification)) {
        (void)command_of(specification);
        return;
    }
    if (is_auto(specification) && part_model(specification).rest != kAuto)
        throw BadInput(
            fmt::format("error: found predictor \"{}\", expected auto or auto:model=FILE; to set parameters "
                        "say arbitrated:model=FILE,KEY=VALUE",
                        specification));
    (void)make_any_predictor(picture_specification(specification), {});
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
            parts.back() += "," + unescaped(std::move(part));
        else
            parts.push_back(unescaped(std::move(part)));
        begin = end + 1;
    }
    return parts;
}

}  // namespace app
