#pragma once
#include <tracking/experience.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// Throws BadInput for a predictor (of pictures, `auto` being allowed) that learns nothing which --save-model could save,
/// and for a file that cannot be made.
void check_learns(const std::string& predictor, const std::filesystem::path& file);

/// Where the model goes that sticks have taught, and what its provenance says of the run.
struct LearnedInPlay {
    std::filesystem::path file;
    std::string command;    ///< `play` or `predict`
    std::string predictor;  ///< with `auto` resolved
    std::string input;      ///< a trace's file, or a live source
};
/// Writes the model that the predictor began with, its last layer as the sticks have taught it, and where it comes from:
/// the run, the model that it began with and that one's own lines, each key behind `base_`.
void save_learned(const LearnedInPlay& run, std::span<const tracking::Experience> experiences);

/// Between processes of one program. Throws std::runtime_error for bytes that are not of it.
[[nodiscard]] std::string bytes_of(std::span<const tracking::Experience> experiences);
[[nodiscard]] std::vector<tracking::Experience> experiences_of(std::string_view bytes);

}  // namespace app
