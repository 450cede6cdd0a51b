#pragma once
#include <span>
#include <string>
#include <vector>

#include "kit/kit.h"

namespace app {

/// Each zone of a kit's instruments, struck in its middle at several speeds.
struct AuditionRow {
    std::size_t instrument = 0;
    int zone = 0;
    double onset_s = 0;  ///< of its first stroke; the others follow kAuditionSpacingS apart
};
inline constexpr double kAuditionSpacingS = 1.5;

struct Audition {
    std::vector<double> speeds_mps;
    std::vector<AuditionRow> rows;
    std::vector<float> sound;  ///< 48 kHz, interleaved stereo, from 0.1 s before the first stroke
};

/// Plays instrument by instrument, zone by zone. Each stroke is played alone and cut, with a fade of 20 ms,
/// where the next one begins, so that no stroke sounds into the next one's measurement. `only`: one
/// instrument's name; empty: all. Throws BadInput for a name that the kit does not have.
[[nodiscard]] Audition audition(const Kit& kit, const std::string& only, std::span<const double> speeds_mps);

/// Compiles a kit's own orchestras and strikes each instrument of theirs. Throws BadInput or audio::SampleError at the
/// place in the orchestra's file.
void check_own_orchestras(const Kit& kit);

/// Greatest sample and RMS of 100 ms from the onset, both channels, in dB of full scale; -200 for silence.
struct StrokeLevel {
    double peak_db = -200, rms_db = -200;
};
[[nodiscard]] StrokeLevel level_of(const Audition& heard, const AuditionRow& row, std::size_t speed);

/// Commands for gnuplot that draw an audition as a PNG file: a row for each zone, two panels for each speed.
/// The first shows the whole stroke, all of one row at one scale; the second the mean of both channels in its
/// first 5 ms, where the contact is heard, at a scale of its own.
[[nodiscard]] std::string audition_sheet(const Kit& kit, const Audition& heard, const std::string& file);

}  // namespace app
