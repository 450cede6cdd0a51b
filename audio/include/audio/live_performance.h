#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio/performance.h"

namespace audio {

struct LiveOptions {
    /// A block is planned to be computed this long before its first sample is due [s]: room for lateness and
    /// for the device's buffer. Notes of that block cannot change any more then.
    double output_lead_s = 0.004;
    double longest_s = 60;     ///< of sound, for which memory is reserved; rendering ends there
    bool jack_audio = false;   ///< play through a running JACK server (its default outputs)
    std::string midi_port;     ///< name of a MIDI output port of ours in JACK; empty: none
    std::string midi_connect;  ///< connect that port to this one, when it is there; empty: leave it open
    std::function<void()> on_thread_start;  ///< run first on the audio thread (its priority)
};

/// One block of sound in real time; nanoseconds of CLOCK_MONOTONIC.
struct BlockTiming {
    std::int64_t planned_ns = 0, started_ns = 0, done_ns = 0;
};

/// A note that was sounded.
struct PlayedNote {
    std::uint64_t id = 0;
    std::int64_t planned_sample = 0;  ///< its onset as asked for last
    std::int64_t onset_sample =
        0;  ///< in the recorded output; later than planned only for a note that came too late
    std::int64_t taken_ns = 0;      ///< when its block was begun: from then on it could not change
    std::int64_t midi_sent_ns = 0;  ///< when the MIDI event was handed over with its onset's time; 0: no MIDI
};

/// A performance on the wall clock: sample n is due at epoch + n/48000 s. One thread owns Csound, computes
/// each block output_lead_s before it is due (the sooner when it has fallen behind: nothing is skipped in the
/// recording), and never waits for anything but the clock. The caller's thread sends notes through a
/// wait-free queue. Notes are never late silently: one that arrives after its block has begun sounds with the
/// next block, and its PlayedNote says so; a cancel or a move that comes too late is counted and answered
/// there too. The recorded samples equal those of the offline Performance for the same notes.
class LivePerformance {
public:
    /// Compiles the orchestra, warms it up, connects to JACK where asked for. Throws std::runtime_error
    /// (also: no JACK server, with what to do).
    LivePerformance(const std::filesystem::path& orchestra, const std::vector<Voice>& voices,
                    const LiveOptions& options);
    ~LivePerformance();
    LivePerformance(const LivePerformance&) = delete;
    LivePerformance& operator=(const LivePerformance&) = delete;

    /// Sample 0 is due at epoch_ns of CLOCK_MONOTONIC, which lies ahead.
    void start(std::int64_t epoch_ns);
    /// Adds or replaces (same id) a note. Wait-free, allocates nothing. False: the queue is full (counted).
    bool schedule(const Note& note) noexcept;
    bool cancel(std::uint64_t id) noexcept;
    /// Notes before this sample cannot change any more. Any thread.
    [[nodiscard]] std::int64_t fixed_sample() const noexcept;
    /// Notes sounded since the last call, in order of onset.
    [[nodiscard]] std::vector<PlayedNote> take_played();
    /// Ends at `minimum_samples` and the sound's tail as Performance::finish, rendered as fast as can be from
    /// here on; returns all samples. Throws what went wrong on the audio thread.
    [[nodiscard]] std::vector<float> finish(std::int64_t minimum_samples, std::int64_t tail_samples);

    /// After finish().
    [[nodiscard]] std::span<const BlockTiming> blocks() const;  ///< those of real time
    [[nodiscard]] int block_size() const;
    [[nodiscard]] std::uint64_t refused_changes() const;  ///< cancels and moves that came too late
    [[nodiscard]] std::uint64_t queue_overflows() const;
    [[nodiscard]] std::uint64_t device_underruns() const;  ///< JACK asked for samples that were not there
    [[nodiscard]] std::string version() const;
    [[nodiscard]] std::string device() const;  ///< "file only" or what JACK says
    [[nodiscard]] double busy_s() const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace audio
