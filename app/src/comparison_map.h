#pragma once
#include <string>
#include <vector>

#include "comparison.h"

namespace app {

/// One estimator at one lead under one sensor: RMS, and against the best tuned baseline there.
struct MapCell {
    double rate_hz = 0, noise_mm = 0, jitter_ms = 0, drop_out = 0, lead_s = 0;
    PairedResult result;
};

}  // namespace app
