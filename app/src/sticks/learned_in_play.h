#pragma once
#include <tracking/experience.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// The file that gets the model which sticks have trained in a run, and what its provenance says of the run.
struct LearnedInPlay {
    std::filesystem::path file;
    std::string command;    ///< `play` or `predict`
    std::string predictor;  ///< with `auto` resolved
    std::string input;      ///< a trace's file, or a live source
};

/// --save-model: saves the model of a predictor with the last layer that it learned from the sticks. Its
/// provenance names the run, the model that the run began with, and the provenance of that model, each key
/// with the prefix `base_`.
class LearnedModel {
public:
    /// To be made before the run begins. Throws BadInput for a predictor that does not learn, for a file that
    /// cannot be made, and for names that a model's head cannot hold.
    explicit LearnedModel(LearnedInPlay run);
    /// Throws std::runtime_error when the file of the model that the run began with has changed since, and
    /// when the file cannot be written.
    void save(std::span<const tracking::Experience> experiences) const;
    /// save() for the end of a run: a failure does not throw but is added to `failures`. Nothing is saved
    /// without experiences. `silent`: the names of sticks whose experience is missing; they are added to
    /// `failures`, too.
    void save_or_say(std::span<const tracking::Experience> experiences,
                     const std::vector<std::string>& silent, std::vector<std::string>& failures) const;

private:
    LearnedInPlay run_;
    std::filesystem::path base_;
    std::string base_sha256_;
    tracking::Provenance provenance_;
};

/// To pass experiences between processes of one program. Throws std::runtime_error for other bytes.
[[nodiscard]] std::string bytes_of(std::span<const tracking::Experience> experiences);
[[nodiscard]] std::vector<tracking::Experience> experiences_of(std::string_view bytes);

}  // namespace app
