#pragma once
#include <tracking/experience.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// Where the model goes that sticks have taught, and what its provenance says of the run.
struct LearnedInPlay {
    std::filesystem::path file;
    std::string command;    ///< `play` or `predict`
    std::string predictor;  ///< with `auto` resolved
    std::string input;      ///< a trace's file, or a live source
};

/// --save-model: the model that a predictor begins with, its last layer as the sticks teach it, and where it comes from:
/// the run, the model that it began with and that one's own lines, each key behind `base_`.
class LearnedModel {
public:
    /// Before anything is played. Throws BadInput for a predictor that learns nothing which could be saved, for a file
    /// that cannot be made, and for names that a model's head cannot hold.
    explicit LearnedModel(LearnedInPlay run);
    /// Throws std::runtime_error when the model that the run began with is another by now, and when the file cannot be
    /// written.
    void save(std::span<const tracking::Experience> experiences) const;
    /// For the end of a run, whose products stay whatever becomes of the model: save(), unless no stick has said what
    /// it learned. Why not all is saved, of the sticks `silent`, too, goes into `failures`.
    void save_or_say(std::span<const tracking::Experience> experiences,
                     const std::vector<std::string>& silent, std::vector<std::string>& failures) const;

private:
    LearnedInPlay run_;
    std::filesystem::path base_;
    std::string base_sha256_;
    tracking::Provenance provenance_;
};

/// Between processes of one program. Throws std::runtime_error for bytes that are not of it.
[[nodiscard]] std::string bytes_of(std::span<const tracking::Experience> experiences);
[[nodiscard]] std::vector<tracking::Experience> experiences_of(std::string_view bytes);

}  // namespace app
