#pragma once
#include <tracking/path_model.h>
#include <tracking/predictor.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace app {

/// The stick that a predictor follows.
struct TrackedStick {
    std::string name = "-";                             ///< external predictors get it
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();  ///< unit, hand to tip, in the body's frame
};

/// Makes predictors of any kind that the command line may name: those of tracking::make_predictor and
/// `exec:CMD`, a child process (ExternalPredictor). A network's `model=FILE` may be the name of a bundled
/// model, as the default is. The constructor reads the file, once.
class PredictorMaker {
public:
    /// `auto` must have been resolved before. `model`: used in place of the file of `model=FILE`. Throws
    /// BadInput with one line, tracking::TraceError for a file that is no model.
    explicit PredictorMaker(const std::string& specification,
                            std::shared_ptr<const tracking::PathModel> model = {});
    /// `leads_s` are the leads that will be asked for: an external predictor computes these, in between its answers
    /// are interpolated. Throws BadInput with one line; std::runtime_error when the child fails.
    [[nodiscard]] std::unique_ptr<tracking::Predictor> make(std::span<const double> leads_s,
                                                            const TrackedStick& stick = {}) const;

private:
    std::string specification_;  // without the model
    std::shared_ptr<const tracking::PathModel> model_;
};

/// PredictorMaker(specification).make(leads_s, stick).
[[nodiscard]] std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                                      std::span<const double> leads_s,
                                                                      const TrackedStick& stick = {});

/// `auto`, or `auto:model=FILE`.
[[nodiscard]] bool is_auto(const std::string& specification);
/// A predictor's specification with `auto` resolved: the predictor that did best in measurements, for
/// pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);
/// The file of the network that a resolved specification names; none without one. Throws BadInput.
[[nodiscard]] std::optional<std::filesystem::path> model_file(const std::string& specification);
/// The model of `auto` if it has a network of contacts, which then takes part in the decision about strikes
/// (ContactForecast); else null.
[[nodiscard]] std::shared_ptr<const tracking::PathModel> contact_model(
    const std::string& sound_specification);
/// The filter that confirms the strikes of a sound predictor's specification; empty for none. With `auto`,
/// contacts less than 50 ms ahead must be confirmed by a second filter (keep_confirmed in sticks/stick.h).
[[nodiscard]] std::string confirming_specification(const std::string& sound_specification);

/// Throws what make_any_predictor would, `auto` being allowed; starts no child.
void check_specification(const std::string& specification);

/// True for `exec:CMD`. Its times include a process and two messages, so tables mark them as external.
[[nodiscard]] bool is_external(const std::string& specification);

/// Splits a comma-separated list of specifications: a part with `=` but no `:` belongs to the one before, unless that
/// is `exec:`. A comma within a command or a file's name is escaped as `\,`. Throws BadInput for empty parts.
[[nodiscard]] std::vector<std::string> split_specifications(const std::string& list);

}  // namespace app
