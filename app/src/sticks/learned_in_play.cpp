#include "sticks/learned_in_play.h"

#include <fmt/format.h>

#include <cstring>
#include <stdexcept>
#include <utility>

#include "files/bad_input.h"
#include "files/checksum.h"
#include "files/output_file.h"
#include "sticks/predictors.h"

namespace app {
namespace {

constexpr std::uint64_t kMostUnits = tracking::PathModel::kMostHidden + 1;

void append(std::string& bytes, const Eigen::MatrixXd& matrix) {
    const std::uint64_t sizes[] = {static_cast<std::uint64_t>(matrix.rows()),
                                   static_cast<std::uint64_t>(matrix.cols())};
    bytes.append(reinterpret_cast<const char*>(sizes), sizeof sizes);
    bytes.append(reinterpret_cast<const char*>(matrix.data()),
                 static_cast<std::size_t>(matrix.size()) * sizeof(double));
}

Eigen::MatrixXd take_matrix(std::string_view& bytes) {
    const auto take = [&](void* to, std::size_t size) {
        if (bytes.size() < size)
            throw std::runtime_error("error: found half of what a sensor learned, expected all");
        std::memcpy(to, bytes.data(), size);
        bytes.remove_prefix(size);
    };
    std::uint64_t sizes[2];
    take(sizes, sizeof sizes);
    if (sizes[0] > kMostUnits || sizes[1] > kMostUnits)
        throw std::runtime_error("error: found what no sensor learns, expected a layer's sums");
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(sizes[0]), static_cast<Eigen::Index>(sizes[1]));
    take(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
    return matrix;
}

}  // namespace

void check_learns(const std::string& predictor, const std::filesystem::path& file) {
    const OutputFile can_be(file);
    const std::string specification = picture_specification(predictor);
    if (!is_external(specification) &&
        tracking::experience_of(*make_any_predictor(specification, {})).has_value())
        return;
    throw BadInput(fmt::format(
        "error: found --save-model with predictor {}, which learns nothing; expected auto, online or "
        "arbitrated",
        predictor));
}

void save_learned(const LearnedInPlay& run, std::span<const tracking::Experience> experiences) {
    const std::filesystem::path file = model_file(run.predictor).value();
    const tracking::PathModel base = tracking::read_path_model(file);
    tracking::PathModel model = tracking::taught(base, experiences);
    tracking::Provenance& lines = model.provenance;
    lines.emplace_back("trained_on", "what was played, from another model on");
    lines.emplace_back("made_by", fmt::format("musicworld {}", MUSICWORLD_VERSION));
    lines.emplace_back("command", fmt::format("musicworld {} {} with predictor {} --save-model {}",
                                              run.command, run.input, run.predictor, run.file.string()));
    if (std::error_code none; std::filesystem::is_regular_file(run.input, none))
        lines.emplace_back("input", sha256_of_file(run.input) + " " + run.input);
    lines.emplace_back("begun_with", sha256_of_file(file) + " " + file.string());
    for (const auto& [key, value] : base.provenance)
        if (!key.starts_with("base_")) lines.emplace_back("base_" + key, value);
    write_finished_file(run.file, tracking::format_path_model(model));
}

std::string bytes_of(std::span<const tracking::Experience> experiences) {
    std::string bytes;
    for (const tracking::Experience& experience : experiences) {
        append(bytes, experience.moments);
        append(bytes, experience.against);
    }
    return bytes;
}

std::vector<tracking::Experience> experiences_of(std::string_view bytes) {
    std::vector<tracking::Experience> experiences;
    while (!bytes.empty()) {
        Eigen::MatrixXd moments = take_matrix(bytes), against = take_matrix(bytes);
        experiences.push_back({std::move(moments), std::move(against)});
    }
    return experiences;
}

}  // namespace app
