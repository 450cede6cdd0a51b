#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "latency/latency_report.h"
#include "play/play.h"
#include "realtime/realtime_session.h"

namespace app {

/// A difference between the run in real time and the offline run of the same trace.
struct Divergence {
    std::uint64_t lap = 0;
    std::uint32_t stick = 0, instrument = 0;
    std::string what;                         ///< e.g. "onset later", "cancelled offline", one word or two
    double offline_onset_s = 0, onset_s = 0;  ///< on the lap's clock; NaN: there is none
    double delay_s = 0;                       ///< the delay that explains it; 0: none was found
    std::string cause;  ///< "sample late", "samples skipped", "the run ended", "unexplained"
};

/// The run beside the offline run of the same trace.
struct OfflineComparison {
    std::size_t offline_strikes = 0;  ///< released ones of the offline run over the same laps
    std::vector<Divergence> departures;

    [[nodiscard]] std::size_t unexplained() const {
        return static_cast<std::size_t>(std::ranges::count(departures, "unexplained", &Divergence::cause));
    }
};

/// The results of a run in real time.
struct RealtimeOutcome {
    PlayResult play;  ///< over all laps, on the run's clock (t0 + time since the epoch)
    RealtimeResult realtime;
    OfflineComparison offline;  ///< traces only
    LatencyReport latency;
    std::string failure;  ///< a sensor that could not go on: the products hold what was played until then;
                          ///< empty: none
};

/// Plays in real time: sensor processes, contacts, strikes, sound and frames against the wall clock, into the
/// folder `out` as play() does (frames in time only; what stayed on the screen instead of a dropped one is
/// linked in its place), with the measurements of latency beside: departures.csv, latency.json, latency.html,
/// samples.csv, frames.csv, notes.csv, blocks.csv, leads.csv, errors.csv and summary.json's object `realtime`.
/// Then plays the trace offline, without frames and sound, and finds where and why the two differ. Throws as
/// play() does, and std::runtime_error for a live run without a sample.
RealtimeOutcome play_realtime(const RealtimeOptions& options, const Warn& warn);

}  // namespace app
