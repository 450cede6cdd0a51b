#pragma once
#include <jack/jack.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "audio/midi_reader.h"
#include "command_queue.h"
#include "device_position.h"
#include "midi_events.h"
#include "sound_device.h"

namespace audio {

/// One client of a running JACK server: sound on two ports, strokes on a MIDI port, MIDI from another. Sample n and a stroke of
/// the same due time leave in the same frame: the one that JACK's own clock gives for that moment.
///
/// Threads: the constructor's (opens, connects, closes); the audio thread (start, publish, send, stop);
/// JACK's, which reads the recording where it lies and never waits. JACK's clock is CLOCK_MONOTONIC_RAW,
/// which drifts against CLOCK_MONOTONIC; their difference is taken anew each cycle.
class JackOutput : public SoundDevice {
public:
    struct Options {
        bool sound = false;        ///< ports out_l and out_r, connected to the first two physical outputs
        std::string midi_port;     ///< name of the MIDI port; empty: none
        std::string midi_connect;  ///< its peer, where that exists
        std::string
            midi_input{};  ///< a port to listen to; empty: none; without a colon a port of ours, left open
        double output_lead_s = 0;
    };

    /// Throws std::runtime_error: no server, another rate than 48 kHz, a period too long for the output lead.
    explicit JackOutput(const Options& options);
    ~JackOutput() override;

    void start(std::span<float> ring, std::int64_t epoch_ns) noexcept override;
    void publish(std::int64_t frames) noexcept override { ring_.publish(frames); }
    /// Hands a stroke over; false where that cannot be. Wait-free.
    [[nodiscard]] bool send(const MidiStroke& stroke) noexcept;
    /// Waits until every note-off is sent (0.1 s after the last stroke). JACK's thread may still be in a cycle, and read the
    /// ring until this is destroyed.
    void stop() noexcept override;
    /// A MIDI message that came, t_s on CLOCK_MONOTONIC; false: none. Of those before the first call the newest 1024 come, from
    /// the next cycle on; later what finds 1024 waiting is dropped. One thread at a time.
    [[nodiscard]] bool take(MidiMessage& message) noexcept {
        taken_.store(true, std::memory_order_relaxed);
        return received_.try_pop(message);
    }

    [[nodiscard]] bool has_midi() const noexcept { return midi_ != nullptr; }
    [[nodiscard]] std::string description() const override;
    /// Why the MIDI port is not connected to the peer that was asked for, one line; empty: it is.
    [[nodiscard]] const std::string& midi_problem() const noexcept { return midi_problem_; }
    [[nodiscard]] DeviceCounts counts() const noexcept override;
    [[nodiscard]] double delay_s() const noexcept override { return 0; }

private:
    struct Cycle {
        jack_nframes_t first_frame = 0;
        std::int32_t frames = 0;
        std::int64_t begin_ns = 0;  ///< when its first frame is due
        bool continuous = true;     ///< it follows the last one without a gap
    };

    static int process(jack_nframes_t frames, void* self);
    static void server_ended(void* self);
    void open_ports(const Options& options);
    void check_timing(const Options& options) const;
    void connect(const Options& options);
    void connect_sound();
    void connect_midi(const std::string& peer);
    void connect_midi_input(const std::string& peer);
    void run_cycle(jack_nframes_t frames) noexcept;
    void measure_clock() noexcept;
    [[nodiscard]] Cycle this_cycle(jack_nframes_t frames) const noexcept;
    void play(const Cycle& cycle) noexcept;
    void leave_ring() noexcept;
    void receive(const Cycle& cycle) noexcept;
    void release_early() noexcept;
    void send_strokes(const Cycle& cycle) noexcept;

    struct Close {
        void operator()(jack_client_t* client) const noexcept { jack_client_close(client); }
    };

    // The opening thread's.
    jack_port_t *left_ = nullptr, *right_ = nullptr, *midi_ = nullptr, *midi_input_ = nullptr;
    std::string description_, midi_problem_;

    // Shared.
    CommandQueue<MidiStroke> strokes_{MidiEvents::kCapacity};
    CommandQueue<MidiMessage> received_{MidiEvents::kCapacity};
    DeviceRing ring_;  // with epoch_ns_, written before sounding_
    std::int64_t epoch_ns_ = 0;
    std::atomic<bool> sounding_{false}, in_cycle_{false}, ended_{false}, taken_{false};
    std::atomic<std::uint64_t> underruns_{0}, corrections_{0}, late_strokes_{0}, lost_strokes_{0};

    // The audio thread's.
    std::int64_t last_due_ns_ = 0;

    // JACK's thread's.
    std::int64_t jack_zero_ns_ = 0;  // CLOCK_MONOTONIC when JACK's microseconds were 0
    DevicePosition position_;
    jack_nframes_t expected_frame_ = 0;
    bool playing_ = false;
    MidiEvents events_;
    std::array<MidiMessage, MidiEvents::kCapacity> early_{};  // a ring of what came before it was asked for
    std::size_t early_count_ = 0;

    std::unique_ptr<jack_client_t, Close> client_;  // last: it is closed first
};

}  // namespace audio
