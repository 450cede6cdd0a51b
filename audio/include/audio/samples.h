#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace audio {

// Recorded sounds. Whatever a file says of a sound that does not change from note to note (tuning, offset, envelope,
// gain, place in the stereo picture) is put into its samples when it is read, at 48 kHz: playing one is reading a
// table, sample by sample, so its first sample is the note's onset and its sound does not depend on where in a block
// that lies.

/// Bad samples: "FILE[:LINE:COLUMN]: error: found ..., expected ...", one line: control characters in it,
/// of what was found, become spaces.
class SampleError : public std::runtime_error {
public:
    explicit SampleError(std::string text);
};

// Limits of what is read.
inline constexpr std::size_t kMostRegions = 4096;  ///< of one file of regions
inline constexpr double kLongestSampleS = 300;     ///< of one sound file, at any rate
inline constexpr std::size_t kMostSampleFrames =
    100'000'000;                                            ///< of a kit, as read and at 48 kHz, all channels
inline constexpr std::size_t kLargestRegionFile = 4 << 20;  ///< text of SFZ and XML [bytes]

/// A recorded sound and the strokes that it answers.
struct SampleRegion {
    int key = -1;                               ///< MIDI note of the zone; -1: every zone
    int low_velocity = 0, high_velocity = 127;  ///< of the stroke, inclusive
    double low_random = 0, high_random = 1;     ///< a number of the stroke in [0, 1) lies in [low, high)
    int sequence_length = 1, sequence_position = 1;
    double velocity_track = 1;   ///< share of the gain (velocity / 127)^2; 0: the gain is always 1
    std::uint32_t wave = 0;      ///< into SampleSet::waves
    double left = 1, right = 1;  ///< gains of both sides
    std::uint32_t frames = 0;    ///< of that wave, without the silence at its end
};

/// The sounds of one instrument.
struct SampleSet {
    /// 48 kHz, one channel each, end with silence; equal ones of a kit are one.
    std::vector<std::shared_ptr<const std::vector<float>>> waves;
    std::vector<SampleRegion> regions;
    std::vector<std::filesystem::path>
        files;                         ///< all that were read; the one that was asked for is the first
    std::vector<std::string> ignored;  ///< opcodes of SFZ that are not understood, each once
    /// Keys without a sound of their own, and the key that sounds in their place.
    std::vector<std::pair<int, int>> stand_ins;
    std::string choke_group;  ///< of SFZ: a group that ends itself (off_by); empty: none
};

/// What the instruments of a kit share while their samples are read: each file is read once.
class SampleLibrary {
public:
    SampleLibrary();
    ~SampleLibrary();
    SampleLibrary(const SampleLibrary&) = delete;
    SampleLibrary& operator=(const SampleLibrary&) = delete;
    class Contents;
    [[nodiscard]] Contents& contents() { return *contents_; }

private:
    std::unique_ptr<Contents> contents_;
};

/// Reads the sounds that answer the MIDI notes `keys`, of which the first must have one and stands in for others that
/// have none: a sound file (whatever libsndfile reads: WAV, FLAC, AIFF,
/// Ogg; it answers all of them), a SoundFont (.sf2; the first preset, or drums, bank 128, where it has them), an SFZ
/// file or a DrumGizmo kit or instrument (.xml). Other sampling rates and tunings are resampled by libsamplerate's best
/// sinc. `keyswitch`: the key of an SFZ file's sw_last that is down; else its default or the lowest. Throws SampleError: no file, not of its format, no sound for a key, more than the limits.
[[nodiscard]] std::shared_ptr<const SampleSet> read_samples(const std::filesystem::path& file,
                                                            std::span<const int> keys, SampleLibrary& library,
                                                            std::optional<int> keyswitch = {});

/// MIDI velocity of a stroke: 127 (v / 8 m/s)^0.7, held to 1..127.
[[nodiscard]] int stroke_velocity(double speed_mps) noexcept;

/// A number in [0, 1) that belongs to a stroke: a hash of its onset and voice (the mixing function of splitmix64:
/// Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
[[nodiscard]] double stroke_random(std::int64_t onset_sample, std::uint32_t voice) noexcept;

/// Calls play(region, gain) for each region that answers a stroke. `counts` holds for each region how many strokes of
/// its key and velocity came before (round robin) and is counted on; it has the set's size.
template <class Play>
void answer(const SampleSet& set, int key, int velocity, double random, std::span<std::uint32_t> counts,
            Play play) {
    for (const auto& [missing, instead] : set.stand_ins)
        if (key == missing) {
            key = instead;
            break;
        }
    for (std::size_t i = 0; i < set.regions.size(); ++i) {
        const SampleRegion& region = set.regions[i];
        if ((region.key >= 0 && region.key != key) || velocity < region.low_velocity ||
            velocity > region.high_velocity)
            continue;
        const auto turn = static_cast<int>(counts[i]++ % static_cast<std::uint32_t>(region.sequence_length));
        if (turn + 1 != region.sequence_position || random < region.low_random ||
            random >= region.high_random)
            continue;
        const double share = velocity / 127.0;
        play(region, 1 - region.velocity_track * (1 - share * share));
    }
}

}  // namespace audio
