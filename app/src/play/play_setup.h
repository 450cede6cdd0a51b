#pragma once
#include <audio/performance.h>
#include <sim/simulation.h>
#include <tracking/trace.h>

#include <memory>
#include <vector>

#include "files/output_folder.h"
#include "kit/kit.h"
#include "pictures/frame_thread.h"
#include "play/play.h"
#include "strikes/strike.h"

namespace app {

/// Sound goes on this long after the last sample, then until it is silent, at most so long.
inline constexpr double kSoundTailS = 0.5, kLongestSoundTailS = 10;

/// Reads a trace that is to be played: at most three hours (a WAV file holds four). Throws BadInput.
[[nodiscard]] tracking::Trace read_played_trace(const std::filesystem::path& file);
/// What is known of a run before it begins.
[[nodiscard]] PlayResult describe(const PlayOptions& options, const tracking::Trace& trace, const Kit& kit,
                                  bool trace_is_file = true);

[[nodiscard]] std::vector<audio::Voice> voices_of(const Kit& kit);
/// The note that sounds a strike: speed through the instrument's velocity curve, place within the struck
/// zone, MIDI note and velocity. MIDI velocity = 127 (v / 8 m/s)^0.7, held to 1..127.
[[nodiscard]] audio::Note note_of(const Strike& strike, const Instrument& instrument);
[[nodiscard]] std::filesystem::path orchestra_file();
[[nodiscard]] std::unique_ptr<sim::Simulation> make_simulation(const Kit& kit, int workers);
/// The thread that draws into the run's folder `frames`; null with --no-frames. `scenes`: one for each level
/// of picture quality.
[[nodiscard]] std::unique_ptr<FrameThread> start_frames(const PlayOptions& options,
                                                        const std::vector<render::SceneDescription>& scenes,
                                                        const render::FrameState& rest,
                                                        const OutputFolder& folder,
                                                        FramePolicy policy = FramePolicy::wait,
                                                        bool realtime_priority = false);

}  // namespace app
