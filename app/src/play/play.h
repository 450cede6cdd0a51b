#pragma once
#include <audio/loudness.h>
#include <audio/performance.h>
#include <tracking/trace.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "files/disk_log.h"
#include "kit/kit.h"
#include "pictures/annotations.h"
#include "pictures/camera.h"
#include "play/pedals.h"
#include "strikes/strike.h"
#include "strikes/true_contacts.h"

namespace app {

/// How the sound of a run ends up.
struct MixOptions {
    double loudness_lufs = -23;     ///< of audio.wav, offline, as far as its true peak allows (-1 dBTP)
    std::optional<double> gain_db;  ///< instead: this in place of the kit's, and no more
    bool stems = false;             ///< also stems/, a WAV file each instrument, without the room
    bool bus_stems = false;         ///< and one each bus
    audio::MidiTime midi;           ///< of hits.mid
};

/// What `musicworld play` was asked for.
struct PlayOptions {
    std::filesystem::path trace;
    std::filesystem::path kit;
    std::filesystem::path out = "out";
    double fps = 30;
    int width = 640, height = 480;
    CameraChoice camera;
    Shown shown;
    double shutter =
        0;  ///< open for this share of the frame interval, up to the frame's time; 0: no motion blur
    std::string picture_predictor = "auto", sound_predictor = "auto";
    double render_lead_s = 1.0 / 30, sound_lead_s = 1.0 / 15, release_margin_s = 0.010;
    double false_cost = 1;  ///< of a false sound; that of a missed strike is 1 (StrikeDecision)
    int workers = 1;
    bool cancelling = true, frames = true, audio = true;
    std::optional<std::uint64_t> solo;  ///< render the sound of this note alone, as it is in the mix
    std::optional<Eigen::Vector3d> tip, shaft;
    MixOptions mix;
    std::optional<std::filesystem::path> pedals;  ///< a schedule or a MIDI file
    std::optional<std::filesystem::path> video;   ///< an MP4, by ffmpeg, in place of the frames
    bool keep_frames = false;                     ///< the frames beside the video, too
    /// File that gets the model of the pictures' predictor as the sticks have taught it.
    std::optional<std::filesystem::path> save_model;
    bool progress = false;  ///< draw a progress bar on standard error
};

/// A stroke as the report shows it: frames that follow each other.
struct Film {
    std::vector<std::filesystem::path> files;  ///< PNG files on disk
    std::size_t struck = 0;                    ///< the first that is shown after the note
    double frame_s = 1.0 / 30;                 ///< from one to the next
};

/// How far the surface that was fitted to an instrument's mesh lies from it.
struct ContactShape {
    std::string instrument;
    sim::SurfaceError error;
    double size_m = 0;  ///< its greatest extent
};

/// The sound of a run.
struct RunSound {
    DiskLog<float> samples;  ///< interleaved stereo, 48 kHz; empty with --no-audio
    std::size_t clipped_samples = 0;
    audio::Loudness loudness;  ///< of the samples
    double gain_db = 0;        ///< that all instruments were given in it
};

/// What a run's results depend on.
struct RunOrigin {
    std::vector<std::pair<std::string, std::string>> inputs;    ///< file, SHA-256
    std::string fingerprint;                                    ///< of this machine and build
    std::vector<std::pair<std::string, std::string>> versions;  ///< of the program and its libraries
};

/// The pictures that a run's report shows.
struct ReportPictures {
    std::vector<std::filesystem::path> frames;  ///< a few PNG files on disk
    std::vector<Film> films;                    ///< strokes that it shows moving; none with a video
    std::string video;                          ///< the video as the report refers to it; empty: none
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
    std::vector<Eigen::Vector3d> middles;  ///< of the instruments [m], world
    std::vector<Strike> strikes;           ///< by id
    Pedals pedals;                         ///< what feet and hands played beside the sticks
    std::size_t pedal_moves_left_out = 0;  ///< of a schedule: those before or after the trace
    std::vector<TrueContact> contacts;     ///< by time
    StrikeScore score;
    std::vector<TipTrack> tracks;
    RunSound sound;
    std::size_t samples_refused = 0;  ///< reports that the filters ignored
    double wall_s = 0;
    std::vector<std::pair<std::string, double>> stages_s;  ///< name, seconds
    int workers_lost = 0, bodies_reowned = 0;
    RunOrigin origin;
    std::vector<ContactShape> contact_shapes;  ///< of instruments with shape = "mesh"
    std::vector<std::string> failures;         ///< why plots, the video or the model are missing
    ReportPictures pictures;
};

/// Plays a recorded trace offline on a virtual clock into the folder `out`: frames/, audio.wav, events.csv,
/// contacts.csv, hits.mid, summary.json and report.html. Throws BadInput, tracking::TraceError or
/// std::invalid_argument for bad input and std::runtime_error for failures while running; then nothing that
/// looks finished is left in `out`.
PlayResult play(const PlayOptions& options);

/// The strikes of play(), by id, without frames and sound and in this process; `moves`: of pedals, by time.
[[nodiscard]] std::vector<Strike> offline_strikes(const tracking::Trace& trace, const Kit& kit,
                                                  const PlayOptions& options, const StickGeometry& stick,
                                                  const std::vector<PedalMove>& moves);

}  // namespace app
