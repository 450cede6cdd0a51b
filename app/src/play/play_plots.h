#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "play/play_result.h"
#include "report/gnuplot.h"

namespace app {

/// What became of a strike or a contact: one mark of the report's plots.
enum class Mark { contact, released, wrong, missed, cancelled };
/// A released strike is `wrong` when no contact is matched to it, a contact `missed` when no strike is.
/// Strike marks by index into strikes.
[[nodiscard]] std::vector<Mark> strike_marks(const PlayResult& result);

/// A note and the contact that it belongs to.
struct MatchedNote {
    double error_ms = 0;  ///< onset - true contact; positive: sound late
    std::uint32_t stick = 0, instrument = 0;
};
/// In the order of the contacts.
[[nodiscard]] std::vector<MatchedNote> matched_notes(const PlayResult& result);

/// The stretches of the recording that the timeline shows, in order: rows of 4 s (the whole of a shorter
/// recording). Of a recording of more than twelve rows it shows the twelve with the most false and missed
/// notes, of equally many the earlier ones.
struct Timeline {
    double row_s = 4;
    std::vector<double> starts_s;
    bool whole = true;
};
[[nodiscard]] Timeline timeline_of(const PlayResult& result);

// Scripts of the report's plots. Times on the trace's clock. Of many marks within a pixel one is kept, so
// that the size is bounded for any length.

/// Tip heights of all sticks with the marks, under it the envelope of the sound with the onsets: a script for
/// each row.
[[nodiscard]] std::vector<PlotScript> timeline_plots(const PlayResult& result, const Timeline& timeline);
/// Notes heard, false and missed over the whole recording, with the rows of the timeline marked.
[[nodiscard]] PlotScript overview_plot(const PlayResult& result, const Timeline& timeline);
/// The envelope of the whole sound, tail included, with the onsets. The result must hold audio.
[[nodiscard]] PlotScript sound_plot(const PlayResult& result);
/// Histogram of onset - true contact [ms]: +-30 ms in bins of 1 ms; +-10 or +-5 ms in finer ones where all
/// errors are smaller.
[[nodiscard]] PlotScript timing_plot(const PlayResult& result);
/// The same with a point for each note and a line for each instrument.
[[nodiscard]] PlotScript timing_by_instrument_plot(const PlayResult& result);
/// For each note, first prediction and decision relative to its onset [ms]; notes by outcome, then by lead.
[[nodiscard]] PlotScript lead_plot(const PlayResult& result);

}  // namespace app
