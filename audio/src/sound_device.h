#pragma once
#include <atomic>
#include <cstdint>
#include <span>
#include <string>

namespace audio {

/// What a device that plays counted.
struct DeviceCounts {
    std::uint64_t underruns = 0;    ///< times that it asked for samples which were not there; silence instead
    std::uint64_t corrections = 0;  ///< samples dropped or repeated to follow the device's clock
    std::uint64_t late_strokes = 0;  ///< MIDI notes whose frame had passed; sent at once
    std::uint64_t lost_strokes = 0;  ///< MIDI notes for which there was no room; never sent
};

/// Interleaved stereo that one thread writes into a ring and a device's thread reads. A device that is held up for longer than
/// half of the ring lasts may read what is being written: such samples are wrong, each of them whole (atomic, relaxed).
class DeviceRing {
public:
    void start(std::span<float> ring) noexcept { ring_ = ring; }
    /// The writer's: a block into the ring from frame `first` on; it does not reach over the ring's end.
    static void write(std::span<float> ring, std::int64_t first, std::span<const float> block) noexcept {
        std::size_t at = 2 * static_cast<std::size_t>(first % static_cast<std::int64_t>(ring.size() / 2));
        for (const float sample : block) std::atomic_ref(ring[at++]).store(sample, std::memory_order_relaxed);
    }
    /// The writer's: so many frames lie ready.
    void publish(std::int64_t frames) noexcept { published_.store(frames, std::memory_order_release); }
    /// Calls put(i, left, right) for frames first, first + 1, ...; silence where there are none. False: some that are due
    /// were not there.
    template <class Put>
    bool read(std::int64_t first, std::int32_t frames, Put put) const noexcept {
        const std::int64_t there = published_.load(std::memory_order_acquire);
        const auto room = static_cast<std::int64_t>(ring_.size() / 2);
        for (std::int32_t i = 0; i < frames; ++i) {
            const std::int64_t sample = first + i;
            // Half of the ring is left to what is being written.
            const bool silent = sample < 0 || sample >= there || sample < there - room / 2;
            const auto at = [&](int channel) {
                if (silent) return 0.0F;
                float& kept = ring_[static_cast<std::size_t>(2 * (sample % room) + channel)];
                return std::atomic_ref(kept).load(std::memory_order_relaxed);
            };
            put(i, at(0), at(1));
        }
        const std::int64_t end = first + frames;
        return !(end > 0 && end > there);
    }

private:
    std::span<float> ring_;
    std::atomic<std::int64_t> published_{0};
};

/// What plays the sound of a live performance.
class SoundDevice {
public:
    SoundDevice() = default;
    virtual ~SoundDevice() = default;
    SoundDevice(const SoundDevice&) = delete;
    SoundDevice& operator=(const SoundDevice&) = delete;

    /// From here on sound is played: interleaved stereo, in a ring that stays where it is and holds what was published
    /// last; sample 0 is due at epoch_ns.
    virtual void start(std::span<float> ring, std::int64_t epoch_ns) noexcept = 0;
    virtual void publish(std::int64_t frames) noexcept = 0;
    /// Silence.
    virtual void stop() noexcept = 0;
    [[nodiscard]] virtual std::string description() const = 0;
    [[nodiscard]] virtual DeviceCounts counts() const noexcept = 0;
    /// How much later than due it plays, beyond what it makes up for [s].
    [[nodiscard]] virtual double delay_s() const noexcept = 0;
};

}  // namespace audio
