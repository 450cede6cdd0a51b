#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "kit/tip_track.h"
#include "play/play_options.h"
#include "strikes/score_strikes.h"
#include "strikes/strike.h"

namespace app {

struct InputFile {
    std::string file, sha256;
};

/// Everything that `play` found out, for the summary, the tables and the report.
struct PlayResult {
    PlayOptions options;  ///< as asked for, the predictors as specifications
    std::string trace, kit_name, trace_source;
    std::size_t sound_models = 1;  ///< that the sound's predictor runs in parallel
    double t0_s = 0, t_end_s = 0;
    std::size_t frames = 0;                ///< drawn
    std::vector<std::string> sticks;       ///< names, by index
    std::vector<std::string> instruments;  ///< names, by index
    std::vector<Strike> strikes;           ///< by id
    std::vector<TrueContact> contacts;     ///< by time
    StrikeScore score;
    std::vector<TipTrack> tracks;
    std::vector<float> audio;         ///< interleaved stereo, 48 kHz; empty with --no-audio
    std::size_t samples_refused = 0;  ///< reports that the filters ignored
    std::size_t clipped_samples = 0;
    double wall_s = 0;
    std::vector<std::pair<std::string, double>> stages_s;  ///< name, seconds
    int workers_lost = 0, bodies_reowned = 0;
    std::vector<InputFile> inputs;
    std::string fingerprint;
    std::vector<std::pair<std::string, std::string>> versions;
    std::vector<std::filesystem::path> report_frames;  ///< a few PNG files on disk that the report shows
};

}  // namespace app
