#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace audio {

/// A channel message and when it comes.
struct MidiMessage {
    double t_s = 0;           ///< from the start of the file; live: on the clock of whoever received it
    std::uint8_t status = 0;  ///< kind and channel
    std::uint8_t data1 = 0, data2 = 0;

    [[nodiscard]] int kind() const { return status & 0xF0; }
};
inline constexpr int kMidiNoteOn = 0x90, kMidiAftertouch = 0xA0, kMidiController = 0xB0;

inline constexpr std::size_t kLargestMidiFile = std::size_t{16} << 20;  ///< bytes

/// The notes on, polyphonic aftertouches and controllers of a Standard MIDI File of format 0 or 1, of all tracks together, by time: tempo changes of every
/// track hold for all of them, before the first a quarter lasts 0.5 s; with an SMPTE division time needs none. Chunks of
/// other kinds, meta events and system exclusive messages are passed over. Throws std::runtime_error "FILE: error: found
/// ... at byte N, expected ..." for what is not of that form, format 2, more than kLargestMidiFile and more
/// than a million of those messages and tempo changes. (Fuzzed.)
[[nodiscard]] std::vector<MidiMessage> parse_midi(std::string_view bytes, const std::string& file);

}  // namespace audio
