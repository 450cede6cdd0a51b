#pragma once
#include <tracking/predictor.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace app {

/// Makes any predictor that the command line may name: those of tracking::make_predictor and `exec:CMD`, a
/// child process (ExternalPredictor). `auto` must have been resolved before. `leads_s` are the leads that
/// will be asked for: an external predictor computes these, in between its answers are interpolated. Throws
/// BadInput with one line.
[[nodiscard]] std::unique_ptr<tracking::Predictor> make_any_predictor(const std::string& specification,
                                                                      std::span<const double> leads_s);

/// Splits a comma-separated list of specifications: a part with `=` but no `:` belongs to the one before, and
/// `exec:` takes the rest of its part up to the next comma that is not escaped as `\,`.
[[nodiscard]] std::vector<std::string> split_specifications(const std::string& list);

}  // namespace app
