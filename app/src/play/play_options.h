#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace app {

/// What `musicworld play` was asked for.
struct PlayOptions {
    std::filesystem::path trace;
    std::filesystem::path kit;
    std::filesystem::path out = "out";
    double fps = 30;
    int width = 640, height = 480;
    std::string picture_predictor = "auto", sound_predictor = "auto";
    double render_lead_s = 1.0 / 30, sound_lead_s = 1.0 / 15, release_margin_s = 0.010;
    int workers = 1;
    bool cancelling = true, frames = true, audio = true;
    std::optional<std::uint64_t> solo;  ///< render the sound of this strike alone
    std::optional<Eigen::Vector3d> tip, shaft;
    std::optional<std::filesystem::path> video;  ///< also an MP4, by ffmpeg
    bool progress = false;                       ///< draw a progress bar on standard error
};

}  // namespace app
