#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio/midi_reader.h"
#include "audio/performance.h"

namespace audio {

struct LiveOptions {
    /// A block is planned to be computed this long before its first sample is due [s]: room for lateness and
    /// for the device's buffer. Notes of that block cannot change any more then.
    double output_lead_s = 0.004;
    double longest_s = 60;  ///< of sound; real time ends there
    /// What plays the sound: nothing, a running JACK server (its first outputs), or a device of ALSA by its name.
    enum class Output : std::uint8_t { none, jack, alsa } output = Output::none;
    std::string alsa_device = "default";
    std::string midi_port{};     ///< name of a MIDI output port of ours in JACK; empty: none
    std::string midi_connect{};  ///< connect that port to this one, when it is there; empty: leave it open
    std::string midi_input{};    ///< a JACK MIDI port to listen to; without a colon a port of ours, left open
    std::function<void()>
        on_thread_start{};  ///< run first on the audio thread and on that of ALSA (priority)
    /// Gets the sound as it is made, interleaved stereo, on a thread of its own, which may wait for a disk: 20 s
    /// of sound have room. What it throws, finish() throws. Empty: nobody wants it.
    std::function<void(std::span<const float>)> take_sound{};
    Mix mix{};
};

/// One block of sound in real time; nanoseconds of CLOCK_MONOTONIC.
struct BlockTiming {
    std::int64_t planned_ns = 0, started_ns = 0, done_ns = 0;
};

/// How many blocks of real time there were so far, and how many were done only after their first sample was
/// due.
struct BlockCount {
    std::uint64_t all = 0, late = 0;
};

/// A note that was sounded.
struct PlayedNote {
    std::uint64_t id = 0;
    std::int64_t planned_sample = 0;  ///< its onset as asked for last before it was taken
    std::int64_t onset_sample =
        0;  ///< in the recorded output; later than planned only for a note that came too late
    std::int64_t taken_ns = 0;      ///< when its block was begun: from then on it could not change
    std::int64_t midi_sent_ns = 0;  ///< when the MIDI event was handed over with its onset's time; 0: no MIDI
};

/// A performance on the wall clock: sample n is due at epoch + n/48000 s. A device plays it device_delay_s later, limited
/// to a true peak of -1 dBTP; what is recorded is not. One thread owns Csound, computes
/// each block output_lead_s before it is due (the sooner when it has fallen behind: nothing is skipped in the
/// recording), and never waits for anything but the clock. The caller's thread sends notes through a
/// wait-free queue. Notes are never late silently: one that arrives after its block has begun sounds with the
/// next block, and its PlayedNote says so; a move or a cancel of a note that was taken already is counted and
/// leaves it alone. The recorded samples equal those of the offline Performance for the same notes, with the
/// onsets that were played.
///
/// Bounds: 1024 commands between two blocks, 4096 notes ahead; 8192 notes and 32768 blocks wait to be taken.
/// Memory does not grow with time. Running, the audio thread allocates nothing, takes no lock and makes no system call but the clock's (Csound's own
/// code excepted).
class LivePerformance {
public:
    /// Compiles the orchestra, warms it up, connects to its device if asked for. Throws std::runtime_error, also if
    /// there is no JACK server, or one whose period the output lead does not cover, or no such device of ALSA; the text
    /// says what to do.
    LivePerformance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                    const LiveOptions& options);
    ~LivePerformance();
    LivePerformance(const LivePerformance&) = delete;
    LivePerformance& operator=(const LivePerformance&) = delete;

    /// Sample 0 is due at epoch_ns of CLOCK_MONOTONIC, which lies ahead. Once; throws std::logic_error.
    void start(std::int64_t epoch_ns);
    /// Adds or replaces (same id) a note. Wait-free, allocates nothing; one thread at a time. False: the
    /// queue is full (counted), the note is invalid (see Performance::schedule), or the audio thread has
    /// failed.
    bool schedule(const Note& note) noexcept;
    bool cancel(std::uint64_t id) noexcept;
    /// Notes before this sample cannot change any more: the end of the block that was begun last. Any thread.
    /// It is published before that block's commands are read. So a command is in time for certain if, *after*
    /// schedule or cancel has returned true, fixed_sample() is at most the note's onset (both of its onsets,
    /// for a move). Read before, it is only a hint: the next block may begin in between.
    [[nodiscard]] std::int64_t fixed_sample() const noexcept;
    /// Whether something went wrong on the audio thread, or with the sound that was taken; finish() throws it.
    [[nodiscard]] bool failed() const noexcept;
    /// Notes sounded since the last call, in order of onset. One thread at a time.
    [[nodiscard]] std::vector<PlayedNote> take_played();
    /// Blocks of real time done since the last call. One thread at a time.
    [[nodiscard]] std::vector<BlockTiming> take_blocks();
    /// Ends at `minimum_samples` and the sound's tail as Performance::finish, rendered as fast as can be from
    /// here on (a device falls silent); returns the number of samples, of which take_sound has got all (and
    /// silence beyond them, if this is called late). Throws what went wrong on the audio thread. Once.
    [[nodiscard]] std::int64_t finish(std::int64_t minimum_samples, std::int64_t tail_samples);

    /// At any time.
    [[nodiscard]] int block_size() const;
    [[nodiscard]] BlockCount block_count() const noexcept;  ///< any thread
    [[nodiscard]] std::uint64_t refused_changes() const;    ///< cancels and moves that came too late
    [[nodiscard]] std::uint64_t queue_overflows() const;    ///< commands and answers without room
    [[nodiscard]] std::uint64_t device_underruns()
        const;  ///< the device asked for samples that were not there
    [[nodiscard]] std::uint64_t device_corrections()
        const;                                         ///< samples dropped or repeated for the device's clock
    [[nodiscard]] std::uint64_t late_strokes() const;  ///< MIDI notes that left later than due
    /// Why the MIDI port is not connected to midi_connect, one line (it stays open); empty: nothing is wrong.
    /// From construction on.
    [[nodiscard]] std::string midi_problem() const;
    [[nodiscard]] std::string version() const;
    [[nodiscard]] std::uint64_t lost_strokes()
        const;  ///< MIDI notes that were not sent: 1024 waited for JACK, or 512 for their time, already
    [[nodiscard]] std::string device() const;  ///< "file only" or what the device says of itself
    /// How much later than due a device plays [s]: the limiter's look-ahead, and what ALSA's buffer needs beyond the output
    /// lead. 0 without a device. MIDI strokes leave as late as the sound.
    [[nodiscard]] double device_delay_s() const;
    /// MIDI messages that came since the last call, t_s from the epoch. One thread at a time.
    [[nodiscard]] std::vector<MidiMessage> take_midi();
    [[nodiscard]] double busy_s() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace audio
