#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "audio/performance.h"

namespace audio {
namespace {

constexpr std::size_t kMp3Chunk = 8192;  // samples a write

/// A file in memory for libsndfile.
struct MemoryFile {
    std::string bytes;
    std::size_t place = 0;

    static MemoryFile& at(void* self) { return *static_cast<MemoryFile*>(self); }
    sf_count_t seek(sf_count_t offset, int whence) {
        const std::size_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? place : bytes.size();
        const sf_count_t to = static_cast<sf_count_t>(from) + offset;
        if (to < 0) return -1;
        place = static_cast<std::size_t>(to);
        return to;
    }
    sf_count_t read(void* to, sf_count_t count) {
        const std::size_t there = bytes.size() - std::min(place, bytes.size()),
                          taken = std::min(there, static_cast<std::size_t>(count));
        if (taken > 0) std::memcpy(to, bytes.data() + place, taken);
        place += taken;
        return static_cast<sf_count_t>(taken);
    }
    sf_count_t write(const void* from, sf_count_t count) {
        const auto length = static_cast<std::size_t>(count);
        if (place + length > bytes.size()) bytes.resize(place + length);
        std::memcpy(bytes.data() + place, from, length);
        place += length;
        return count;
    }
    static SF_VIRTUAL_IO calls() {
        return {[](void* self) { return static_cast<sf_count_t>(at(self).bytes.size()); },
                [](sf_count_t offset, int whence, void* self) { return at(self).seek(offset, whence); },
                [](void* to, sf_count_t count, void* self) { return at(self).read(to, count); },
                [](const void* from, sf_count_t count, void* self) { return at(self).write(from, count); },
                [](void* self) { return static_cast<sf_count_t>(at(self).place); }};
    }
};

}  // namespace

std::string encode_mp3(std::span<const float> interleaved) {
    SF_INFO format{};
    format.samplerate = kSampleRate;
    format.channels = 2;
    format.format = SF_FORMAT_MPEG | SF_FORMAT_MPEG_LAYER_III;
    MemoryFile file;
    SF_VIRTUAL_IO calls = MemoryFile::calls();
    std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> sound(sf_open_virtual(&calls, SFM_WRITE, &format, &file),
                                                      sf_close);
    if (!sound) throw std::runtime_error(std::string("error: cannot make an MP3: ") + sf_strerror(nullptr));
    std::array<float, kMp3Chunk> chunk{};
    for (std::size_t begin = 0; begin < interleaved.size(); begin += kMp3Chunk) {
        const std::size_t count = std::min(kMp3Chunk, interleaved.size() - begin);
        std::transform(&interleaved[begin], &interleaved[begin] + count, chunk.begin(),
                       [](float sample) { return std::clamp(sample, -1.0F, 1.0F); });
        const auto items = static_cast<sf_count_t>(count);
        if (sf_write_float(sound.get(), chunk.data(), items) != items)
            throw std::runtime_error(std::string("error: cannot make an MP3: ") + sf_strerror(sound.get()));
    }
    sound.reset();  // writes the last frames and the length
    return std::move(file.bytes);
}

}  // namespace audio
