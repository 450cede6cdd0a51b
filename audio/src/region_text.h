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
    std::int64_t loop_start = 0,
                 loop_end = -1;  ///< first and last frame of its loop; none: loop_end < loop_start
    [[nodiscard]] std::size_t frames() const { return channels.empty() ? 0 : channels.front().size(); }
};

/// One channel of a recording and its place in the stereo picture.
struct ChannelUse {
    int channel = 0;  ///< from 0
    double left = 1, right = 1;
};

/// How a sample goes on behind its loop's last frame. A stroke holds its key until the envelope has decayed and the loop was
/// heard once.
enum class LoopMode {
    as_recorded,  ///< continuous where the recording has a loop
    none,
    continuous,  ///< again and again, through the release
    sustain,     ///< again and again until the key is let go, then on to the end
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
    double ampeg_release = 0.001;  ///< [s], by 80 dB; heard of loops alone
    LoopMode loop_mode = LoopMode::as_recorded;
    std::int64_t loop_start = -1, loop_end = -1;  ///< first and last frame; -1: as recorded
    int sw_lolast = -1, sw_hilast = -1;           ///< keyswitches that it answers to; -1: all
    int group = 0, off_by = 0;
    std::vector<ChannelUse>
        channels{};  ///< empty: of one channel both sides, of two one each; more are refused
};

struct WrittenRegions {
    std::vector<WrittenRegion> regions;
    std::vector<std::filesystem::path> files;  ///< beside the samples: the file itself and what it includes
    std::vector<std::string> ignored;
    int sw_default = -1;  ///< the keyswitch that is down; -1: none
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
