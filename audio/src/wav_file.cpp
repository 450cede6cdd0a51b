#include <fcntl.h>
#include <sndfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr double kFullScale = 8388607;  // 2^23 - 1: the largest 24-bit sample
constexpr std::size_t kChunk = 8192;    // samples a write

struct Close {
    void operator()(SNDFILE* file) const noexcept { sf_close(file); }
};

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
    throw std::runtime_error("error: cannot write " + file.string() + ": " +
                             std::generic_category().message(error) +
                             "; free some space or choose another --out");
}

/// The file below libsndfile, which itself tells of no failed write of a header.
class Sink {
public:
    explicit Sink(const std::filesystem::path& file) {
        do number_ = open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        while (number_ < 0 && errno == EINTR);
        if (number_ < 0) error_ = errno;
    }
    ~Sink() { finish(); }
    Sink(const Sink&) = delete;
    Sink& operator=(const Sink&) = delete;

    /// Closes it.
    void finish() {
        const int number = std::exchange(number_, -1);
        if (number >= 0 && close(number) != 0 && errno != EINTR) note();
    }
    /// The number of the first error; 0: none.
    [[nodiscard]] int error() const { return error_; }

    static SF_VIRTUAL_IO calls() {
        return {[](void* self) { return at(self).length(); },
                [](sf_count_t offset, int whence, void* self) { return at(self).seek(offset, whence); },
                [](void* bytes, sf_count_t count, void* self) {
                    return static_cast<sf_count_t>(
                        read(at(self).number_, bytes, static_cast<std::size_t>(count)));
                },
                [](const void* bytes, sf_count_t count, void* self) {
                    return at(self).write(static_cast<const char*>(bytes), count);
                },
                [](void* self) { return at(self).seek(0, SEEK_CUR); }};
    }

private:
    static Sink& at(void* self) { return *static_cast<Sink*>(self); }
    void note() {
        if (error_ == 0) error_ = errno;
    }
    [[nodiscard]] sf_count_t length() const {
        struct stat status {};
        return fstat(number_, &status) == 0 ? status.st_size : -1;
    }
    [[nodiscard]] sf_count_t seek(sf_count_t offset, int whence) const {
        return lseek(number_, offset, whence);
    }
    sf_count_t write(const char* bytes, sf_count_t count) {
        sf_count_t done = 0;
        while (done < count && error_ == 0) {
            const ssize_t wrote = ::write(number_, bytes + done, static_cast<std::size_t>(count - done));
            if (wrote > 0) done += wrote;
            if (wrote == 0) error_ = ENOSPC;
            if (wrote < 0 && errno != EINTR) note();
        }
        return done;
    }

    int number_ = -1, error_ = 0;
};

/// The sample as libsndfile wants it for 24-bit files: in the upper three bytes. NaN counts as clipped
/// silence.
int to_pcm(float value, std::size_t& clipped) {
    if (!(value >= -1 && value <= 1)) ++clipped;
    const double bounded =
        std::isnan(value) ? 0.0 : std::fmin(1.0, std::fmax(-1.0, static_cast<double>(value)));
    return static_cast<int>(std::lround(bounded * kFullScale)) * 256;
}

}  // namespace

std::size_t write_wav(const std::filesystem::path& file, std::span<const float> interleaved) {
    if (interleaved.size() % 2 != 0)
        throw std::logic_error("write_wav: found an odd number of samples, expected pairs");
    SF_INFO format{};
    format.samplerate = kSampleRate;
    format.channels = 2;
    format.format = SF_FORMAT_WAV | SF_FORMAT_PCM_24;
    Sink sink(file);
    const auto check = [&](bool done, SNDFILE* sound) {
        if (sink.error() != 0) fail(file, sink.error());
        if (!done)
            throw std::runtime_error("error: cannot write " + file.string() + ": " + sf_strerror(sound));
    };
    check(true, nullptr);
    SF_VIRTUAL_IO calls = Sink::calls();
    std::unique_ptr<SNDFILE, Close> sound(sf_open_virtual(&calls, SFM_WRITE, &format, &sink));
    check(sound != nullptr, nullptr);
    std::size_t clipped = 0;
    std::array<int, kChunk> chunk{};
    for (std::size_t begin = 0; begin < interleaved.size(); begin += kChunk) {
        const std::size_t count = std::min(kChunk, interleaved.size() - begin);
        for (std::size_t i = 0; i < count; ++i) chunk[i] = to_pcm(interleaved[begin + i], clipped);
        const auto items = static_cast<sf_count_t>(count);
        check(sf_write_int(sound.get(), chunk.data(), items) == items, sound.get());
    }
    const bool whole = sf_close(sound.release()) == 0;  // completes the header
    sink.finish();
    check(whole, nullptr);
    return clipped;
}

}  // namespace audio
