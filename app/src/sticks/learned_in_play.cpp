#include "sticks/learned_in_play.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <type_traits>
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

/// The length of the stick's name, 0 for none, the name and the numbers.
void append(std::string& bytes, const std::optional<tracking::Trust>& trust) {
    static_assert(std::is_trivially_copyable_v<decltype(trust->leads)>);
    const std::uint64_t length = trust ? trust->stick.size() : 0;
    bytes.append(reinterpret_cast<const char*>(&length), sizeof length);
    if (length == 0) return;
    bytes.append(trust->stick);
    bytes.append(reinterpret_cast<const char*>(&trust->leads), sizeof trust->leads);
}

void take(std::string_view& bytes, void* to, std::size_t size) {
    if (bytes.size() < size)
        throw std::runtime_error("error: found half of what a sensor learned, expected all");
    std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
}

Eigen::MatrixXd take_matrix(std::string_view& bytes) {
    std::uint64_t sizes[2];
    take(bytes, sizes, sizeof sizes);
    if (sizes[0] > kMostUnits || sizes[1] > kMostUnits)
        throw std::runtime_error("error: found what no sensor learns, expected a layer's sums");
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(sizes[0]), static_cast<Eigen::Index>(sizes[1]));
    take(bytes, matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
    return matrix;
}

std::optional<tracking::Trust> take_trust(std::string_view& bytes) {
    std::uint64_t length = 0;
    take(bytes, &length, sizeof length);
    if (length == 0) return std::nullopt;
    tracking::Trust trust;
    trust.stick.resize(std::min<std::uint64_t>(length, bytes.size()));
    take(bytes, trust.stick.data(), length);
    take(bytes, &trust.leads, sizeof trust.leads);
    return trust;
}

}  // namespace

LearnedModel::LearnedModel(LearnedInPlay run) : run_(std::move(run)) {
    const OutputFile can_be(run_.file);
    if (is_external(run_.predictor) ||
        !tracking::experience_of(*make_any_predictor(run_.predictor, {})).has_value())
        throw BadInput(fmt::format(
            "error: found --save-model with predictor {}, which learns nothing; expected auto, online or "
            "arbitrated",
            run_.predictor));
    base_ = model_file(run_.predictor).value();
    base_sha256_ = sha256_of_file(base_);
    provenance_.emplace_back("trained_on", "what was played, from another model on");
    provenance_.emplace_back("made_by", fmt::format("musicworld {}", MUSICWORLD_VERSION));
    provenance_.emplace_back(
        "command", fmt::format("musicworld {} {} with predictor {} --save-model {}", run_.command, run_.input,
                               run_.predictor, run_.file.string()));
    if (std::error_code none; std::filesystem::is_regular_file(run_.input, none))
        provenance_.emplace_back("input", sha256_of_file(run_.input) + " " + run_.input);
    provenance_.emplace_back("begun_with", base_sha256_ + " " + base_.string());
    for (const auto& [key, value] : tracking::read_path_model(base_).provenance)
        if (!key.starts_with("base_")) provenance_.emplace_back("base_" + key, value);
    try {
        tracking::check_provenance(provenance_);
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("error: {}", wrong.what()));
    }
}

void LearnedModel::save(std::span<const tracking::Experience> experiences) const {
    if (const std::string now = sha256_of_file(base_); now != base_sha256_)
        throw std::runtime_error(
            fmt::format("error: found another model in {} than when the run began (SHA-256 {}), expected {}; "
                        "{} was not written",
                        base_.string(), now, base_sha256_, run_.file.string()));
    tracking::PathModel model = tracking::taught(tracking::read_path_model(base_), experiences);
    model.provenance = provenance_;
    write_finished_file(run_.file, tracking::format_path_model(model));
}

void LearnedModel::save_or_say(std::span<const tracking::Experience> experiences,
                               const std::vector<std::string>& silent,
                               std::vector<std::string>& failures) const {
    for (const std::string& stick : silent)
        failures.push_back(fmt::format(
            "error: found that the sensor of stick {} did not say what it learned, expected it at the end; "
            "{}",
            stick,
            experiences.empty() ? fmt::format("{} was not written", run_.file.string())
                                : fmt::format("{} is as the others taught it", run_.file.string())));
    if (experiences.empty()) return;
    try {
        save(experiences);
    } catch (const std::exception& wrong) {
        failures.emplace_back(wrong.what());
    }
}

std::string bytes_of(std::span<const tracking::Experience> experiences) {
    std::string bytes;
    for (const tracking::Experience& experience : experiences) {
        append(bytes, experience.moments);
        append(bytes, experience.against);
        append(bytes, experience.trust);
    }
    return bytes;
}

std::vector<tracking::Experience> experiences_of(std::string_view bytes) {
    std::vector<tracking::Experience> experiences;
    while (!bytes.empty()) {
        Eigen::MatrixXd moments = take_matrix(bytes), against = take_matrix(bytes);
        experiences.push_back({std::move(moments), std::move(against), take_trust(bytes)});
    }
    return experiences;
}

}  // namespace app
