#pragma once
#include <span>
#include <vector>

namespace app {

/// Levels of a stereo sound over time and frequency, for a picture.
/// Short-time Fourier transform: Hann windows of 2048 samples; a column is the greatest of those in it (at most
/// four, evenly spaced, however long it is), a row the greatest of the frequencies in it, or what lies between two where
/// rows are narrower than those. 0 dB is a sine of full scale on both sides: of an amplitude A on the left and B on the
/// right 10 log10((A^2 + B^2) / 2).
struct Spectrogram {
    int columns = 0, rows = 0;
    double low_hz = 50, high_hz = 20000;  ///< rows lie evenly in log f
    std::vector<float> level_db;          ///< column by column, from low to high; at least -200

    [[nodiscard]] float at(int column, int row) const {
        return level_db[static_cast<std::size_t>(column) * static_cast<std::size_t>(rows) +
                        static_cast<std::size_t>(row)];
    }
    /// Middle of a row [Hz].
    [[nodiscard]] double frequency_hz(double row) const;
};

/// `stereo`: interleaved, 48 kHz; the columns lie evenly over all of it.
[[nodiscard]] Spectrogram spectrogram(std::span<const float> stereo, int columns, int rows);

}  // namespace app
