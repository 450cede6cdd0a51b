#pragma once
#include "compare/comparison.h"

namespace app {

/// Compares. A pure function of the files and options but for ns_per_sample and `exec:` predictors with a
/// state of their own. Predictors named bare or with
/// parameters run as they are; of each family that has parameters to tune, `NAME*` runs those that erred
/// least (RMS, at that lead) on other recordings (the `--tune` ones, or all others that are compared), and
/// `NAME**` those from the recordings of other persons; the advance of `auto`'s strikes is learned on the
/// same recordings as `NAME*`. A map tunes on all others that are compared, `--tune` or not. Throws BadInput
/// (also where nothing can be scored, or two files hold the same samples), tracking::TraceError.
[[nodiscard]] Comparison compare(const ComparisonOptions& options);

}  // namespace app
