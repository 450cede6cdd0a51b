#pragma once
#include <tracking/trace.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kit/stick_geometry.h"

namespace app {

/// Times of one stick that scoring treats apart [s, the trace's clock], ascending.
struct MarkedTimes {
    std::vector<double> impacts_s;            ///< contacts
    std::vector<double> flagged_s;            ///< positions not to be trusted
    std::vector<double> flagged_rotations_s;  ///< orientations not to be trusted
};

/// A trace with what is known about it.
///
/// Beside TRACE.csv may lie TRACE.hits.csv (columns t,stick,label: impacts) and TRACE.flags.csv (columns
/// t,stick,kind,size: glitches; stick `both` means all; kinds that begin with `orientation` mark
/// orientations, the others positions). Without a hits file the impacts are the lows of the recorded tip
/// (find_lows). The person is named by the folder, followed by the first word of the file's name if that
/// numbers people (p3, player2, subject01); a folder without such names is one person.
struct Recording {
    std::string file;  ///< as given
    std::string person;
    tracking::Trace trace;
    StickGeometry geometry;          ///< the trace's own tip and shaft
    std::vector<MarkedTimes> marks;  ///< a stick each
};

/// `persons`: (TEXT, NAME) pairs; the first TEXT that the path contains names the person instead. Throws
/// tracking::TraceError and BadInput with the place of the fault.
[[nodiscard]] Recording read_recording(const std::string& file,
                                       const std::vector<std::pair<std::string, std::string>>& persons = {});

/// The same from memory, without files beside it.
[[nodiscard]] Recording recording_of(tracking::Trace trace, std::string person);

/// Whether both hold the same samples, whatever their files and sticks are called.
[[nodiscard]] bool same_samples(const Recording& a, const Recording& b);

/// Throws BadInput if two of them hold the same samples.
void require_distinct(std::span<const Recording> recordings);

}  // namespace app
