#pragma once
#include <tracking/predictor.h>

#include <span>
#include <string>

namespace app {

/// Wall time of a sample: correct() and predict() at every lead, nothing else; the median over several passes
/// of a fresh predictor over the first 4096 samples. The only figure that differs between runs.
[[nodiscard]] double nanoseconds_per_sample(const std::string& specification,
                                            std::span<const tracking::PoseSample> samples,
                                            std::span<const double> leads_s);

}  // namespace app
