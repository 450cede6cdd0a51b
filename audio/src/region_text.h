#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "audio/samples.h"

namespace audio {

/// Sound as it was recorded.
struct Recording {
    double rate_hz = 48000;
    std::vector<std::vector<float>> channels;  ///< equally long
    [[nodiscard]] std::size_t frames() const { return channels.empty() ? 0 : channels.front().size(); }
};

/// One channel of a recording and its place in the stereo picture.
struct ChannelUse {
    int channel = 0;  ///< from 0
    double left = 1, right = 1;
};

/// A region as its file describes it; names as SFZ (sfzformat.com), units as there.
struct WrittenRegion {
    std::filesystem::path sample;
    std::string place;                             ///< FILE:LINE:COLUMN of the sample's name, for messages
    std::shared_ptr<const Recording> recording{};  ///< instead of `sample`: shared by a file's regions
    int lokey = 0, hikey = 127, pitch_keycenter = 60;
    double pitch_keytrack = 100;     ///< [cents a key]
    double tune = 0, transpose = 0;  ///< [cents], [semitones]
    int lovel = 0, hivel = 127;
    double lorand = 0, hirand = 1;
    int seq_length = 1, seq_position = 1;
    double volume = 0, pan = 0, amplitude = 100;  ///< [dB], -100 left ... 100 right, [%]
    double amp_veltrack = 100;                    ///< [%]
    std::int64_t offset = 0, end = -1;            ///< [frames]; end is the last one played, -1: the file's
    double delay = 0;                             ///< [s]
    double ampeg_delay = 0, ampeg_attack = 0, ampeg_hold = 0, ampeg_decay = 0;  ///< [s]
    double ampeg_sustain = 100;                                                 ///< [%]
    int group = 0, off_by = 0;
    std::vector<ChannelUse>
        channels{};  ///< empty: of one channel both sides, of two one each, of more the first two
};

struct WrittenRegions {
    std::vector<WrittenRegion> regions;
    std::vector<std::filesystem::path> files;  ///< beside the samples: the file itself and what it includes
    std::vector<std::string> ignored;
};

/// A letter, a digit or an underscore.
[[nodiscard]] inline bool is_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}
/// Control characters become spaces; cut at 80 characters.
[[nodiscard]] std::string printable(std::string_view text);
[[noreturn]] void fail_at(const std::string& place, const std::string& found, const std::string& expected);

/// The text of a file of at most kLargestRegionFile bytes. Throws SampleError at `place` (the file itself: empty).
[[nodiscard]] std::string read_region_file(const std::filesystem::path& file, const std::string& place = "");

/// SFZ 1 and what of 2 drum kits use; opcodes that are not understood are named and left out. `include` gives the
/// text of an #include. Throws SampleError.
[[nodiscard]] WrittenRegions parse_sfz(std::string_view text, const std::filesystem::path& file);

/// SoundFont 2.04 (Creative Labs, 2006) from its bytes. Throws SampleError.
[[nodiscard]] WrittenRegions parse_sf2(std::string_view bytes, const std::filesystem::path& file);

/// DrumGizmo's kit.xml or an instrument of it: of a kit the instrument that its midimap.xml beside it gives to the
/// keys. Throws SampleError.
[[nodiscard]] WrittenRegions parse_drumgizmo(std::string_view text, const std::filesystem::path& file);

}  // namespace audio
