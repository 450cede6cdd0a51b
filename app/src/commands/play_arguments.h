#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "play/play.h"

namespace app {

/// The options of a run as typed, the same in `play` and `latency`.
struct PlayArguments {
    std::string trace, kit = "drums", out, fps = "30", size = "640x480";
    std::string predictor, picture_predictor, sound_predictor;
    std::string render_lead = "1/30", sound_lead = "1/15", release_margin = "0.010";
    std::string tip, shaft;
    int workers = 1;
    bool no_cancel = false, no_frames = false, no_audio = false;
};

/// Adds them to a command, all but the folder to write into.
void add_play_options(CLI::App& command, PlayArguments& arguments);

/// Throws BadInput for what they cannot be.
[[nodiscard]] PlayOptions play_options(const PlayArguments& arguments);

}  // namespace app
