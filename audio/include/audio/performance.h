#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace audio {

struct SampleSet;

inline constexpr int kSampleRate = 48000;

/// A playable voice: an instrument of the orchestra with its parameters.
struct Voice {
    std::string name;        ///< the kit's name of it
    std::string instrument;  ///< named instr of the orchestra: "drum", "bell", "string", "cymbal"
    /// Parameters by name, as the orchestra documents them (frequency_hz, decay_s, ...). Unknown names throw.
    std::vector<std::pair<std::string, double>> parameters;
    double pan = 0.5;  ///< 0 left, 1 right; constant power
    double gain_db = 0;
    /// A new note fades the group's older ones from its own first sample to exact zero within 15 ms; notes of
    /// equal onset leave each other alone. Empty: none.
    std::string choke_group{};
    /// Recorded sounds that it plays instead of the instrument (audio/samples.h). They do not change; the kit that read
    /// them and the performances of its voices own them together.
    std::shared_ptr<const SampleSet> samples{};
    /// The file whose instrument it is, an orchestra of one's own that is put behind the performance's (audio/orchestra.h).
    /// Empty: an instrument of the performance's orchestra.
    std::filesystem::path own_orchestra{};
    /// What these parameters are at the far end of its pedal's way (Note::pedal 1), by name. In between they go
    /// evenly, those of a sign in ratios. With decay_s among them, what rings follows the pedal to within a block:
    /// all its modes' decay times change by the ratio of the decay_s there and where the note began. Recorded sounds, of
    /// whose parameters nothing else is used, and orchestras of one's own are damped as a whole, as if decay_s were the
    /// time in which they fall by 60 dB; they never ring longer than by themselves.
    std::vector<std::pair<std::string, double>> pedal_parameters{};
    double balance = 0;       ///< of its bus: -1 left alone ... 1 right alone
    double room_send_db = 0;  ///< gain of what the room hears of it; -60 and below: nothing
};

/// One strike as the audio hears it, or what a hand or a foot does to a voice.
struct Note {
    enum class Kind : std::uint8_t {
        stroke,
        choke,  ///< sounds nothing, but fades what the voice sounds, as a note of its choke group does
        pedal,  ///< sounds nothing: the voice's pedal comes to `pedal`, and what rings decays as there
    };
    std::uint64_t id = 0;           ///< unique, positive
    std::uint32_t voice = 0;        ///< index into the voices
    std::int64_t onset_sample = 0;  ///< first sample, counted from the start of the performance; >= 0
    double speed_mps = 1;           ///< strike speed: loudness and brightness
    double place = 0;               ///< 0 centre of the struck zone ... 1 its edge
    int zone = 0;                   ///< 0 head, 1 rim, ... (the voice's zones in the kit's order)
    int midi_note = 38;
    int midi_velocity = 64;  ///< 1-127
    double pedal = 0;        ///< 0: the voice's pedal is at rest ... 1: at the far end of its way
    Kind kind = Kind::stroke;
};

/// How a room answers, recorded: at 48 kHz, from each of two sides (first index) to each of two ears.
struct ImpulseResponse {
    std::array<std::array<std::vector<float>, 2>, 2> from_to;  ///< equally long
    [[nodiscard]] std::size_t size() const { return from_to[0][0].size(); }
};
inline constexpr double kLongestImpulseS = 20;

/// Reads one: a sound file of one channel (of each side, to its own ear), two (left to left, right to right) or four (left
/// to left, left to right, right to left, right to right). Other sampling rates are resampled.
/// Throws SampleError (audio/samples.h): no such file, another number of channels, longer than kLongestImpulseS, silent.
[[nodiscard]] std::shared_ptr<const ImpulseResponse> read_impulse_response(const std::filesystem::path& file);

/// The room around the voices.
struct RoomSound {
    double t60_s = 0;       ///< time in which its low frequencies fall by 60 dB; 0: no room
    double level_db = -16;  ///< energy of the room's answer against that of the dry sound
    /// A recorded room instead, brought to level_db. Empty: none.
    std::shared_ptr<const ImpulseResponse> impulse{};
};

/// What becomes of the voices' sum.
struct Mix {
    double gain_db = 0;  ///< of all
    RoomSound room;
    /// Sounds these voices alone, as they sound among the others (which still choke them), without the room. Empty:
    /// all.
    std::vector<std::uint32_t> alone{};
    /// Sounds the note of this id alone, as it sounds among the others (which still choke it and take their turns in a round
    /// robin), in the room. Empty: all.
    std::optional<std::uint64_t> alone_note{};
};

/// An offline performance: notes are scheduled, moved and cancelled ahead of the sample up to which audio has
/// been asked for; sound is rendered by Csound on a thread of its own. The samples are a pure function of the
/// notes that stood when their onset was rendered: a cancelled note leaves no trace. Throws
/// std::runtime_error for an orchestra that does not compile or an unknown instrument or parameter.
class Performance {
public:
    /// `orchestra`: the .orc file.
    Performance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                const Mix& mix = {});
    ~Performance();
    Performance(const Performance&) = delete;
    Performance& operator=(const Performance&) = delete;

    /// Adds or replaces (same id) a note. Throws std::logic_error if its onset, or that of the note that it
    /// replaces, lies before the sample given to advance_to, and for an invalid note: without id or voice, or
    /// with a value out of range.
    void schedule(const Note& note);
    /// Removes a note that has not been reached by advance_to; throws std::logic_error for another id.
    void cancel(std::uint64_t id);
    /// Everything before `sample` is fixed and may be rendered; a smaller sample than before changes nothing.
    /// Returns at once (it waits only while 256 commands are outstanding); rendering happens on the audio
    /// thread, in whole blocks. An error of that thread is thrown by one of the next calls, at the latest by
    /// finish.
    void advance_to(std::int64_t sample);
    /// Renders to `minimum_samples`, then on until the output stays below -80 dBFS (the last sample is the
    /// last one that is not), at most `tail_samples` more; returns all samples, interleaved stereo in [-1, 1]
    /// nominal (not normalised, not clipped). Notes still ahead are played. Ends the performance: later calls
    /// throw std::logic_error.
    [[nodiscard]] std::vector<float> finish(std::int64_t minimum_samples, std::int64_t tail_samples);

    /// "Csound 6.18.1, sample-accurate: ..." for reports.
    [[nodiscard]] std::string version() const;
    /// Seconds of processor time the audio thread has spent rendering.
    [[nodiscard]] double busy_s() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

/// 48 kHz, stereo, 24-bit PCM; values beyond [-1, 1] are clipped and counted in the return value. Throws
/// std::runtime_error (disk full, no permission).
std::size_t write_wav(const std::filesystem::path& file, std::span<const float> interleaved);

/// The same sound as an MP3 file, about 100 kbit/s, to be heard in a page; values beyond [-1, 1] are clipped. Throws
/// std::runtime_error.
[[nodiscard]] std::string encode_mp3(std::span<const float> interleaved);

/// How a MIDI file counts time.
struct MidiTime {
    double tempo_bpm = 120;  ///< quarters a minute, 20 to 400; a file holds whole microseconds a quarter
    int beats = 4;           ///< of a bar, 1 to 64 ...
    int beat_unit = 4;       ///< ... each such a part of a whole note: 1, 2, 4, 8, 16, 32
    bool operator==(const MidiTime&) const = default;
};

/// A controller of a MIDI file, on channel 10 as the notes.
struct MidiControl {
    std::int64_t sample = 0;
    int controller = 4, value = 0;  ///< 0-127
};

/// Standard MIDI file (format 0, 960 ticks a quarter at 120 per minute, at any tempo nearly 1920 ticks a second),
/// channel 10, one note-on per note and its note-off 0.1 s later, a polyphonic aftertouch of 127 for a choke; `controls`
/// say where pedals are: the file's bytes. Times are right whatever the tempo. Throws std::runtime_error for a key,
/// velocity or onset that MIDI has not, and std::logic_error for such a tempo or time signature.
[[nodiscard]] std::vector<std::uint8_t> encode_midi(const std::vector<Note>& notes, const MidiTime& time = {},
                                                    const std::vector<MidiControl>& controls = {});

}  // namespace audio
