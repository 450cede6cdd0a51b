#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "device_position.h"
#include "sound_device.h"

typedef struct _snd_pcm snd_pcm_t;  // NOLINT: ALSA's own name; its header stays out of this one

namespace audio {

/// Sound through ALSA: a device of asound.conf ("default", "hw:0", "pipewire", "null"), 48 kHz, stereo, float or 32 or
/// 16 bits, periods of about 128 frames, a buffer of about four. Frames are written as the device takes them; which sample is
/// due when they sound follows from the device's own delay. What its buffer needs beyond the output lead it plays late, by
/// delay_s(). A device without a clock of its own ("null", "file") is given frames at the clock's pace.
///
/// Threads: the caller's; one of its own, which writes and reads the ring.
class AlsaOutput : public SoundDevice {
public:
    /// on_thread_start is run first on the device's thread (its priority); it must not throw. Throws std::runtime_error: no
    /// such device, in use, not 48 kHz stereo.
    AlsaOutput(const std::string& device, double output_lead_s, std::function<void()> on_thread_start = {});
    ~AlsaOutput() override;

    void start(std::span<float> ring, std::int64_t epoch_ns) noexcept override;
    void publish(std::int64_t frames) noexcept override { ring_.publish(frames); }
    void stop() noexcept override;
    [[nodiscard]] std::string description() const override;
    [[nodiscard]] DeviceCounts counts() const noexcept override;
    [[nodiscard]] double delay_s() const noexcept override { return delay_s_; }

private:
    enum class Format : std::uint8_t { real, whole32, whole16 };
    struct Close {
        void operator()(snd_pcm_t* pcm) const noexcept;
    };
    void set_up();
    void run(const std::stop_token& stop) noexcept;
    /// False where the device does not take frames yet.
    [[nodiscard]] bool wait_for_room() noexcept;
    /// Frames that it was given before their time.
    [[nodiscard]] std::int64_t given_ahead() const noexcept;
    /// Frames that sound before the next one that is written.
    [[nodiscard]] std::int64_t ahead() noexcept;
    void write_period() noexcept;
    void recover(int error) noexcept;
    void put(std::int32_t frame, float left, float right) noexcept;

    std::string device_;
    std::function<void()> on_thread_start_;
    std::unique_ptr<snd_pcm_t, Close> pcm_;
    Format format_ = Format::real;
    std::int32_t period_ = 128, buffer_ = 512;
    double delay_s_ = 0;

    // Shared.
    DeviceRing ring_;
    std::int64_t epoch_ns_ = 0;  // written before sounding_
    std::atomic<bool> sounding_{false}, lost_{false};
    std::atomic<std::uint64_t> underruns_{0}, corrections_{0};

    // The device's thread's.
    DevicePosition position_;
    bool continuous_ = false;
    bool waits_ = false;  // it has made us wait: it has a clock
    std::int64_t given_since_ns_ = 0, given_ = 0;
    std::vector<std::int32_t> frames_;  // of a period, in the device's format

    std::jthread thread_;  // last: it ends first
};

}  // namespace audio
