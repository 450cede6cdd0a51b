#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "play/play.h"
#include "report/plot.h"

namespace app {

/// What became of a strike or a contact: one mark of the report's plots.
struct Mark {
    /// A released strike is `wrong` when no contact is matched to it, a contact `missed` when no strike is.
    enum class Kind { contact, missed, released, wrong, cancelled };
    Kind kind;
    double t_s = 0, height_m = 0;  ///< of the contact, or of the onset and the struck point
    std::uint32_t instrument = 0;
    const Strike* strike = nullptr;  ///< of the result; null for contacts
};
/// Contacts (a missed one twice, also as a contact), then strikes, in their order.
[[nodiscard]] std::vector<Mark> marks_of(const PlayResult& result);

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

/// What the darkest and the brightest colour of a spectrogram stand for [dB of full scale].
struct LevelRange {
    double low_db = -70, high_db = 0;
};

/// The plots of a run, in frames. Times on the trace's clock. Of many marks within a pixel one is kept, so that
/// the size is bounded for any length.
struct PlayPlots {
    Timeline timeline;
    /// Tip heights of all sticks with the marks, under it the envelope of the sound with the onsets: one for
    /// each row.
    std::string rows;
    /// Histogram of onset - true contact [ms]: +-30 ms in bins of 1 ms; +-10 or +-5 ms in finer ones where all
    /// errors are smaller. And the same with a point for each note and a line for each instrument.
    std::string timing, instruments;
    /// For each note, first prediction and decision relative to its onset [ms]; notes by outcome, then by
    /// lead.
    std::string leads;
    std::string sound;        ///< the whole sound, tail included, with the onsets; empty without sound
    std::string spectrogram;  ///< of all of it, with the onsets; empty without sound
    LevelRange levels;        ///< of the spectrogram
    std::string overview;     ///< notes heard, false and missed; empty where the timeline shows all
};
[[nodiscard]] PlayPlots add_play_plots(PlotGallery& gallery, const PlayResult& result);

}  // namespace app
