#pragma once
#include <gtest/gtest.h>
#include <sndfile.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "audio/samples.h"

/// A folder of sounds for as long as a test needs it.
class SampleFolder {
public:
    SampleFolder() {
        std::string name = testing::TempDir() + "musicworld-samples-XXXXXX";
        if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
        path_ = name;
    }
    ~SampleFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    SampleFolder(const SampleFolder&) = delete;
    SampleFolder& operator=(const SampleFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    std::filesystem::path text(const std::string& name, const std::string& text) const {
        std::ofstream(path_ / name, std::ios::binary) << text;
        return path_ / name;
    }
    /// 32-bit float WAV, or 24-bit FLAC by its name.
    std::filesystem::path sound(const std::string& name, const std::vector<float>& samples, int channels = 1,
                                int rate_hz = 48000) const {
        SF_INFO info{};
        info.channels = channels, info.samplerate = rate_hz;
        info.format =
            name.ends_with(".flac") ? SF_FORMAT_FLAC | SF_FORMAT_PCM_24 : SF_FORMAT_WAV | SF_FORMAT_FLOAT;
        SNDFILE* file = sf_open((path_ / name).c_str(), SFM_WRITE, &info);
        EXPECT_NE(file, nullptr);
        sf_writef_float(file, samples.data(), static_cast<sf_count_t>(samples.size()) / channels);
        sf_close(file);
        return path_ / name;
    }

private:
    std::filesystem::path path_;
};

inline std::shared_ptr<const audio::SampleSet> samples_of(const std::filesystem::path& file,
                                                          const std::vector<int>& keys = {38}) {
    audio::SampleLibrary library;
    return audio::read_samples(file, keys, library);
}

/// What reading these samples complains of; empty: nothing.
inline std::string fault_of(const std::filesystem::path& file, const std::vector<int>& keys = {38}) {
    try {
        (void)samples_of(file, keys);
    } catch (const audio::SampleError& fault) {
        return fault.what();
    }
    return "";
}
