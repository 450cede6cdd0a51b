#pragma once
#include <tracking/training.h>

#include <span>
#include <string>
#include <vector>

#include "compare/recording.h"

namespace app {

/// What a network learns from, and what it is validated by.
struct TrainingField {
    std::vector<tracking::TrainingStick> sticks;
    std::string held_out;  ///< one sentence
};

/// Of five recordings or more every fifth, counted from the fifth, is held out; of fewer, the last fifth of each in
/// time. What flags mark is not learned from. Throws BadInput where the recordings are too short for that.
[[nodiscard]] TrainingField training_field(std::span<const Recording> recordings);

}  // namespace app
