#pragma once
#include <audio/live_performance.h>
#include <audio/performance.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "files/output_folder.h"
#include "kit/kit.h"
#include "pictures/frame_thread.h"
#include "play/play.h"
#include "play/strike_pipeline.h"
#include "process/clock.h"
#include "report/plot.h"
#include "strikes/strike.h"

namespace app {

// How a run begins and ends, offline and in real time: its parts, its sound, its products.

/// Sound goes on this long after the last sample, then until it is silent, at most so long.
inline constexpr double kSoundTailS = 0.5, kLongestSoundTailS = 10;

/// A trace and the SHA-256 of the bytes that it was read from; empty if it came from no file.
struct PlayedTrace : tracking::Trace {
    std::string sha256;
};
/// Reads a trace that is to be played, once (it may be a pipe): at most three hours (a WAV file holds four).
/// Throws BadInput.
[[nodiscard]] PlayedTrace read_played_trace(const std::filesystem::path& file);
/// Throws std::runtime_error where a program is missing that the run's end will need.
void require_tools(const PlayOptions& options);
/// What is known of a run before it begins.
[[nodiscard]] PlayResult describe(const PlayOptions& options, const PlayedTrace& trace, const Kit& kit);

[[nodiscard]] std::vector<audio::Voice> voices_of(const Kit& kit);
/// All notes that a run sounded, those of pedals included, by onset.
[[nodiscard]] std::vector<audio::Note> notes_of(const PlayResult& result, const Kit& kit);
[[nodiscard]] std::filesystem::path orchestra_file();
[[nodiscard]] std::unique_ptr<sim::Simulation> make_simulation(const Kit& kit, int workers);
/// t0_s: time of audio sample 0, by the clock of the run's samples.
[[nodiscard]] PipelineSettings pipeline_settings(const PlayOptions& options, const StickGeometry& stick,
                                                 double t0_s);
/// The thread that draws into the run's folder `frames`; null with --no-frames. `scenes`: one for each level
/// of picture quality.
[[nodiscard]] std::unique_ptr<FrameThread> start_frames(const PlayOptions& options,
                                                        const std::vector<render::SceneDescription>& scenes,
                                                        const render::FrameState& rest,
                                                        const OutputFolder& folder,
                                                        FramePolicy policy = FramePolicy::wait,
                                                        bool realtime_priority = false);

/// What a run's products are made from, beside its result.
struct RunParts {
    const Kit& kit;
    const StickGeometry& stick;
    const sim::Simulation& simulation;
    FrameThread* frames = nullptr;  ///< absent: nothing is drawn
    const WallTimer& wall;          ///< since the start of the run
};

/// The kit's mix with the gain that was asked for.
[[nodiscard]] audio::Mix mix_of(const PlayOptions& options, const Kit& kit);
/// Measures a sound that was mixed with `mix`. With `may_change` one gain brings it to the loudness that was
/// asked for, unless a gain was. In play_sound.cpp, as the next.
void set_loudness(RunSound& sound, const MixOptions& asked, const audio::Mix& mix, bool may_change);
/// Replaces the sound, which was made with `mix`, by that of the note of --solo alone: as it is in the mix,
/// choked by the others, with the same gain and length.
void keep_solo(PlayResult& result, const Kit& kit, const audio::Mix& mix);
/// Writes stems/NN_NAME.wav, as long as the sound of all, for each instrument that was sounded: they add up
/// to it without its room. With bus_stems stems/NN_bus_NAME.wav likewise for each bus.
void write_stems(const PlayResult& result, const Kit& kit, const OutputFolder& folder);

/// Ends the sound of a run that lasted `seconds`: result.sound, audio.wav, version and time of the thread.
/// Sound: audio::Performance or audio::LivePerformance.
template <class Sound>
void finish_sound(Sound& sound, double seconds, PlayResult& result, const Kit& kit,
                  const OutputFolder& folder) {
    const auto length = static_cast<std::int64_t>(std::ceil((seconds + kSoundTailS) * audio::kSampleRate));
    const auto tail = static_cast<std::int64_t>(kLongestSoundTailS * audio::kSampleRate);
    constexpr bool is_live = std::is_same_v<Sound, audio::LivePerformance>;
    if constexpr (is_live)
        result.sound.samples.cut(2 *
                                 static_cast<std::size_t>(sound.finish(length, tail)));  // which has taken it
    else
        result.sound.samples.append(sound.finish(length, tail));
    const audio::Mix mix = mix_of(result.options, kit);
    set_loudness(result.sound, result.options.mix, mix, !is_live);
    if (result.options.solo) keep_solo(result, kit, mix);
    result.sound.clipped_samples = audio::write_wav(folder.path("audio.wav"), result.sound.samples);
    result.stages_s.emplace_back("sound (own thread)", sound.busy_s());
    result.origin.versions.emplace_back("csound", sound.version());
}

/// From a run whose strikes, tracks and sound are in `result` to a finished folder: scores the strikes
/// against the true contacts, then writes hits.mid, the video, events.csv, contacts.csv, report.html and
/// summary.json. `realtime_part`, of a run in real time: called once the strikes are scored, writes what such
/// a run has beside and returns summary.json's object `realtime`.
void write_products(PlayResult& result, const RunParts& parts, OutputFolder& folder,
                    const std::function<std::string()>& realtime_part = {});

/// Text of summary.json: one object, keys in a fixed order, numbers that read back to the same double. The
/// keys that scripts rely on come first; times in seconds unless the name says _ms. timing_ms.median and .p95
/// are null when no note matched a contact, realtime_factor when no wall time was measured. Apart from
/// realtime_factor, stages_s and wall_s the text is a pure function of the input.
[[nodiscard]] std::string format_summary(const PlayResult& result, const std::string& realtime_json = {});

// Both tables: numbers read back to the same double; a name that holds a comma, a quote or a line break is
// quoted (RFC 4180); lines end in "\n".

/// Text of events.csv: a row for every note that was scheduled, by id. Columns
///   id,stick,instrument,onset_s,speed_mps,px,py,pz,scheduled_at_s,outcome,moves,decided_at_s,model
/// stick and instrument by name; onset_s, scheduled_at_s and decided_at_s on the trace's clock [s]; px,py,pz
/// the struck point on the surface [m], world; outcome released|cancelled; model the predictor that played
/// it. Behind them what pedals, hands and tips played: no stick (a tip's choke: its own), the middle of the
/// instrument, model pedal, foot, choke or tip. Throws std::logic_error for a strike that is still pending:
/// every note of a finished run was decided.
[[nodiscard]] std::string format_events(const PlayResult& result);

/// Text of contacts.csv: a row for every true contact, by time. Columns
///   t,stick,instrument,speed_mps,px,py,pz,matched_id
/// px,py,pz the centre of the tip [m]; matched_id the note that sounded it, 0 for a missed one.
[[nodiscard]] std::string format_contacts(const PlayResult& result);

/// Returns when frame k is on disk, with its picture if that is at hand.
using FrameAtHand = std::function<std::optional<render::Image>(std::uint64_t k)>;
/// The parts of report.html that take time.
struct ReportSections {
    std::string listen, plots, films, frames;
};
[[nodiscard]] ReportSections report_sections(const PlayResult& result, Plotter& plotter,
                                             const FrameAtHand& frame_at_hand);

/// Text of report.html: what was played, key figures, pictures, plots and tables on one page that needs
/// nothing beside it: no script, no font, no address; pictures and plots lie within. Light and dark follow
/// the reader's system. All names are escaped. The frames of `report_frames` are read from disk. A pure
/// function of the result without its times and workers, of the frames and of gnuplot's version. Throws
/// std::runtime_error without a frame. In play_report.cpp.
[[nodiscard]] std::string format_report(const PlayResult& result, const ReportSections& sections);

}  // namespace app
