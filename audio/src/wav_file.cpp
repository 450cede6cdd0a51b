#include <sndfile.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr double kFullScale = 8388607;       // 2^23 - 1: the largest 24-bit sample
constexpr std::size_t kChunk = 8192;         // samples a write
constexpr std::uintmax_t kHeaderBytes = 44;  // RIFF, fmt and data headers: the least a WAV file has

struct Close {
    void operator()(SNDFILE* file) const noexcept { sf_close(file); }
};

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& what) {
    throw std::runtime_error(file.string() + ": " + what + ", expected a writable file with room for it");
}

/// The sample as libsndfile wants it for 24-bit files: in the upper three bytes. NaN counts as clipped
/// silence.
int to_pcm(float value, std::size_t& clipped) {
    if (!(value >= -1 && value <= 1)) ++clipped;
    const double bounded =
        std::isnan(value) ? 0.0 : std::fmin(1.0, std::fmax(-1.0, static_cast<double>(value)));
    return static_cast<int>(std::lround(bounded * kFullScale)) * 256;
}

}  // namespace

std::size_t write_wav(const std::filesystem::path& file, const std::vector<float>& interleaved) {
    if (interleaved.size() % 2 != 0)
        throw std::logic_error("write_wav: found an odd number of samples, expected pairs");
    SF_INFO format{};
    format.samplerate = kSampleRate;
    format.channels = 2;
    format.format = SF_FORMAT_WAV | SF_FORMAT_PCM_24;
    std::unique_ptr<SNDFILE, Close> sound(sf_open(file.c_str(), SFM_WRITE, &format));
    if (!sound) fail(file, sf_strerror(nullptr));
    std::size_t clipped = 0;
    std::array<int, kChunk> chunk{};
    for (std::size_t begin = 0; begin < interleaved.size(); begin += kChunk) {
        const std::size_t count = std::min(kChunk, interleaved.size() - begin);
        for (std::size_t i = 0; i < count; ++i) chunk[i] = to_pcm(interleaved[begin + i], clipped);
        const auto items = static_cast<sf_count_t>(count);
        if (sf_write_int(sound.get(), chunk.data(), items) != items) fail(file, sf_strerror(sound.get()));
    }
    if (sf_close(sound.release()) != 0) fail(file, "closing failed");
    // libsndfile does not report every failed write of the header.
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error || size < kHeaderBytes + 3 * interleaved.size()) fail(file, "the file is incomplete");
    return clipped;
}

}  // namespace audio
