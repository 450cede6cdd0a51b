#include "alsa_output.h"

#include <alsa/asoundlib.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <mutex>
#include <stdexcept>

#include "audio/performance.h"
#include "clocks.h"

namespace audio {
namespace {

constexpr unsigned kPeriods = 4;
constexpr int kPatienceMs = 100;
constexpr double kToCompute_s = 0.001;
constexpr std::int64_t kPauseNs = 1'000'000, kAfterLossNs = 100'000'000;

/// ALSA writes on standard error of its own accord otherwise.
void be_quiet(const char*, int, const char*, int, const char*, ...) {}

[[noreturn]] void fail(const std::string& device, const std::string& found, const std::string& remedy) {
    throw std::runtime_error("ALSA: device `" + device + "`: found " + found + "; " + remedy);
}

}  // namespace

void AlsaOutput::Close::operator()(snd_pcm_t* pcm) const noexcept {
    snd_pcm_close(pcm);
}

AlsaOutput::AlsaOutput(const std::string& device, double output_lead_s, std::function<void()> on_thread_start)
    : device_(device), on_thread_start_(std::move(on_thread_start)) {
    static std::once_flag quiet;
    std::call_once(quiet, [] { snd_lib_error_set_handler(&be_quiet); });
    snd_pcm_t* pcm = nullptr;
    if (const int error = snd_pcm_open(&pcm, device.c_str(), SND_PCM_STREAM_PLAYBACK, 0); error < 0)
        fail(device, snd_strerror(error),
             device == "pipewire" ? "PipeWire is reached through its ALSA plugin: install pipewire-alsa and "
                                    "start PipeWire, or run "
                                    "this under pw-jack with --output jack"
                                  : "name one that `aplay -L` lists, and that nothing else uses");
    pcm_.reset(pcm);
    set_up();
    const double buffer_s = static_cast<double>(buffer_ + period_) / kSampleRate + kToCompute_s;
    delay_s_ = std::max(0.0, buffer_s - output_lead_s);
    frames_.resize(2 * static_cast<std::size_t>(period_));
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

AlsaOutput::~AlsaOutput() = default;

void AlsaOutput::set_up() {
    snd_pcm_t* pcm = pcm_.get();
    snd_pcm_hw_params_t* hardware = nullptr;
    snd_pcm_hw_params_alloca(&hardware);
    const auto check = [this](int error, const char* what) {
        if (error < 0)
            fail(device_, std::string("no ") + what + " (" + snd_strerror(error) + ")",
                 "name a device that converts, as plughw: and default do");
    };
    check(snd_pcm_hw_params_any(pcm, hardware), "configuration");
    check(snd_pcm_hw_params_set_access(pcm, hardware, SND_PCM_ACCESS_RW_INTERLEAVED), "interleaved frames");
    const struct {
        snd_pcm_format_t format;
        Format ours;
    } formats[] = {{SND_PCM_FORMAT_FLOAT, Format::real},
                   {SND_PCM_FORMAT_S32, Format::whole32},
                   {SND_PCM_FORMAT_S16, Format::whole16}};
    int error = -1;
    for (const auto& each : formats)
        if (error < 0 && (error = snd_pcm_hw_params_set_format(pcm, hardware, each.format)) >= 0)
            format_ = each.ours;
    check(error, "format of float, 32 or 16 bits");
    check(snd_pcm_hw_params_set_channels(pcm, hardware, 2), "two channels");
    check(snd_pcm_hw_params_set_rate(pcm, hardware, static_cast<unsigned>(kSampleRate), 0), "48000 Hz");
    auto period = static_cast<snd_pcm_uframes_t>(period_);
    check(snd_pcm_hw_params_set_period_size_near(pcm, hardware, &period, nullptr),
          "period of about 128 frames");
    snd_pcm_uframes_t buffer = kPeriods * period;
    check(snd_pcm_hw_params_set_buffer_size_near(pcm, hardware, &buffer), "buffer of about four periods");
    check(snd_pcm_hw_params(pcm, hardware), "such configuration");
    if (period < 1 || period > 8192 || buffer > 65536)
        fail(device_,
             "periods of " + std::to_string(period) + " frames, a buffer of " + std::to_string(buffer),
             "name a device with shorter ones");
    period_ = static_cast<std::int32_t>(period), buffer_ = static_cast<std::int32_t>(buffer);
    check(snd_pcm_prepare(pcm), "readiness");
}

void AlsaOutput::start(std::span<float> ring, std::int64_t epoch_ns) noexcept {
    ring_.start(ring);
    epoch_ns_ = epoch_ns;
    sounding_.store(true, std::memory_order_seq_cst);
}

void AlsaOutput::stop() noexcept {
    sounding_.store(false, std::memory_order_seq_cst);
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
}

std::string AlsaOutput::description() const {
    return "ALSA `" + device_ + "` at 48000 Hz, periods of " + std::to_string(period_) +
           " frames, a buffer of " + std::to_string(buffer_) +
           (lost_.load(std::memory_order_relaxed) ? " (the device was lost)" : "");
}

DeviceCounts AlsaOutput::counts() const noexcept {
    return {underruns_.load(std::memory_order_relaxed), corrections_.load(std::memory_order_relaxed), 0, 0};
}

void AlsaOutput::run(const std::stop_token& stop) noexcept {
    if (on_thread_start_) on_thread_start_();
    given_since_ns_ = monotonic_ns();
    while (!stop.stop_requested())
        if (wait_for_room()) write_period();
    snd_pcm_drop(pcm_.get());
}

bool AlsaOutput::wait_for_room() noexcept {
    const snd_pcm_sframes_t room = snd_pcm_avail_update(pcm_.get());
    if (room < 0) {
        recover(static_cast<int>(room));
        return false;
    }
    if (room < period_) {
        waits_ = true;
        const int waited = snd_pcm_wait(pcm_.get(), kPatienceMs);
        if (waited < 0) recover(waited);
        if (snd_pcm_state(pcm_.get()) == SND_PCM_STATE_PREPARED) snd_pcm_start(pcm_.get());
        return false;
    }
    // One that has taken a buffer ahead of the clock and never made us wait has none of its own.
    if (waits_ || given_ahead() < buffer_) return true;
    sleep_until_ns(monotonic_ns() + kPauseNs);
    return false;
}

std::int64_t AlsaOutput::given_ahead() const noexcept {
    return std::max<std::int64_t>(given_ - ns_samples(monotonic_ns() - given_since_ns_), 0);
}

std::int64_t AlsaOutput::ahead() noexcept {
    if (!waits_) return given_ahead();
    snd_pcm_sframes_t delay = 0;
    if (snd_pcm_delay(pcm_.get(), &delay) < 0 || delay < 0) delay = 0;
    return delay;
}

void AlsaOutput::put(std::int32_t frame, float left, float right) noexcept {
    const float sides[] = {std::clamp(left, -1.0F, 1.0F), std::clamp(right, -1.0F, 1.0F)};
    for (std::int32_t side = 0; side < 2; ++side) {
        const auto at = static_cast<std::size_t>(2 * frame + side);
        if (format_ == Format::real) {
            frames_[at] = std::bit_cast<std::int32_t>(sides[side]);
        } else if (format_ == Format::whole32) {
            frames_[at] =
                static_cast<std::int32_t>(std::lround(static_cast<double>(sides[side]) * 2147483647.0));
        } else {
            const auto value = static_cast<std::int16_t>(std::lround(sides[side] * 32767.0F));
            std::memcpy(reinterpret_cast<std::int16_t*>(frames_.data()) + at, &value, sizeof value);
        }
    }
}

void AlsaOutput::write_period() noexcept {
    if (sounding_.load(std::memory_order_seq_cst)) {
        const std::int64_t sounds_ns = monotonic_ns() + samples_ns(ahead()) - epoch_ns_;
        const double due = (static_cast<double>(sounds_ns) * 1e-9 - delay_s_) * kSampleRate;
        const std::int64_t first = position_.begin_cycle(due, period_, continuous_);
        if (!ring_.read(first, period_,
                        [this](std::int32_t i, float left, float right) { put(i, left, right); }))
            underruns_.fetch_add(1, std::memory_order_relaxed);
        corrections_.store(position_.corrections(), std::memory_order_relaxed);
        continuous_ = true;
    } else {
        for (std::int32_t i = 0; i < period_; ++i) put(i, 0, 0);
    }
    const snd_pcm_sframes_t written =
        snd_pcm_writei(pcm_.get(), frames_.data(), static_cast<snd_pcm_uframes_t>(period_));
    if (written < 0)
        recover(static_cast<int>(written));
    else
        given_ += written;
}

void AlsaOutput::recover(int error) noexcept {
    if (sounding_.load(std::memory_order_relaxed)) underruns_.fetch_add(1, std::memory_order_relaxed);
    continuous_ = false;
    given_since_ns_ = monotonic_ns(), given_ = 0;
    const bool lost = snd_pcm_recover(pcm_.get(), error, 1) < 0;
    lost_.store(lost, std::memory_order_relaxed);
    if (lost) sleep_until_ns(monotonic_ns() + kAfterLossNs);
}

}  // namespace audio
