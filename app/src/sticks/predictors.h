#pragma once
#include <tracking/predictor.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace app {

/// Makes any predictor that the command line may name: those of tracking::make_predictor and `exec:CMD`, a
/// child process (ExternalPredictor). `auto` must have been resolved before. `leads_s` are the leads that
/// will be asked for: an external predictor computes these, in between its answers are interpolated. `stick`
/// is the name that an external predictor gets. Throws BadInput with one line; std::runtime_error when the
/// child fails.
[[nodiscard]] std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                                      std::span<const double> leads_s,
                                                                      const std::string& stick = "-");

/// A predictor's specification with `auto` resolved: what measurements chose for pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);
/// The filter that confirms the strikes of a sound predictor's specification; empty for none. With `auto`,
/// contacts less than 50 ms ahead must be confirmed by a second filter (keep_confirmed in sticks/stick.h).
[[nodiscard]] std::string confirming_specification(const std::string& sound_specification);

/// Throws BadInput if make_any_predictor would; starts no child.
void check_specification(const std::string& specification);

/// True for `exec:CMD`: its time includes a process and two messages, and is marked as external.
[[nodiscard]] bool is_external(const std::string& specification);

/// Throws what made an external predictor give up (its correct() and predict() cannot throw); does nothing
/// for all others. To be called before a run's results are used.
void require_working(const tracking::Predictor& predictor);

/// Splits a comma-separated list of specifications: a part with `=` but no `:` belongs to the one before, and
/// `exec:` takes the rest of its part up to the next comma that is not escaped as `\,`. Throws BadInput for
/// empty parts.
[[nodiscard]] std::vector<std::string> split_specifications(const std::string& list);

/// Whether a sample became part of an estimator's state.
[[nodiscard]] inline bool is_taken(tracking::SampleStatus status) {
    return status == tracking::SampleStatus::accepted || status == tracking::SampleStatus::reinitialised;
}

/// Feeds a sample to a predictor and returns how far the predictor's state then lies behind it [s]; 0 if the
/// predictor took it. What is expected `lead_s` after the sample is predict(lead_s + that), also where the sample
/// was refused. Throws std::runtime_error if an external predictor has failed.
[[nodiscard]] inline double feed(tracking::Predictor& predictor, const tracking::PoseSample& sample) {
    if (is_taken(predictor.correct(sample))) return 0;
    require_working(predictor);
    return std::max(0.0, sample.t_s - predictor.time_s());
}

}  // namespace app
