#include <samplerate.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <set>

#include "audio/performance.h"
#include "region_text.h"

namespace audio {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestSoundFont = std::size_t{512} << 20;  // bytes
constexpr int kMostChannels = 64;
constexpr double kGuardS = 0.002;  // silence at a wave's end

bool is_file(const fs::path& file) {
    std::error_code error;
    return fs::is_regular_file(file, error);
}

std::string bytes_of(const fs::path& file, std::size_t most, const std::string& place) {
    const std::string at = place.empty() ? file.string() + ":1:1" : place;
    if (!is_file(file)) fail_at(at, "\"" + printable(file.string()) + "\", which is no file", "a file");
    std::error_code error;
    if (fs::file_size(file, error) > most)
        fail_at(at, "more than " + std::to_string(most >> 20) + " MiB in " + printable(file.string()),
                "less");
    std::ifstream stream(file, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (!stream.good() && !stream.eof()) fail_at(at, printable(file.string()) + " unreadable", "a file");
    return bytes;
}

struct CloseFile {
    void operator()(SNDFILE* file) const noexcept { sf_close(file); }
};

/// Reads a sound file; `place` is where it is named.
Recording read_sound(const fs::path& file, const std::string& place) {
    const std::string name = "\"" + printable(file.string()) + "\"";
    if (!is_file(file)) fail_at(place, "sample " + name + ", which is no file", "a sound file");
    SF_INFO info{};
    const std::unique_ptr<SNDFILE, CloseFile> sound(sf_open(file.c_str(), SFM_READ, &info));
    if (!sound)
        fail_at(place, name + ", in which libsndfile reads: " + printable(sf_strerror(nullptr)),
                "WAV, FLAC or another sound file");
    if (info.channels < 1 || info.channels > kMostChannels || info.samplerate < 1000 ||
        info.samplerate > 768000)
        fail_at(place,
                name + " of " + std::to_string(info.channels) + " channels at " +
                    std::to_string(info.samplerate) + " Hz",
                "1 to 64 channels, 1000 to 768000 Hz");
    if (info.frames < 1 || static_cast<double>(info.frames) > kLongestSampleS * info.samplerate)
        fail_at(place, name + " of " + std::to_string(info.frames) + " frames",
                "1 to " + std::to_string(static_cast<int>(kLongestSampleS)) + " s of sound");
    const auto channels = static_cast<std::size_t>(info.channels);
    if (static_cast<std::size_t>(info.frames) > kMostSampleFrames / channels)
        fail_at(place,
                name + " of " + std::to_string(info.frames) + " frames of " + std::to_string(channels) +
                    " channels",
                "at most " + std::to_string(kMostSampleFrames) + " samples");
    std::vector<float> all(static_cast<std::size_t>(info.frames) * channels);
    const sf_count_t read = sf_readf_float(sound.get(), all.data(), info.frames);
    if (read != info.frames)
        fail_at(place,
                name + ", which ends after " + std::to_string(read) + " of " + std::to_string(info.frames) +
                    " frames",
                "a whole file");
    if (!std::all_of(all.begin(), all.end(), [](float x) { return std::abs(x) <= 1000; }))
        fail_at(place, name + " with samples that are no numbers or beyond 1000", "samples about -1 to 1");
    Recording recording;
    recording.rate_hz = info.samplerate;
    recording.channels.assign(channels, std::vector<float>(static_cast<std::size_t>(info.frames)));
    for (std::size_t i = 0; i < all.size(); ++i) recording.channels[i % channels][i / channels] = all[i];
    return recording;
}

/// Resamples a channel so that `ratio` times as many samples last as long.
std::vector<float> resampled(const std::vector<float>& samples, double ratio, const std::string& place) {
    if (ratio == 1) return samples;
    std::vector<float> result(
        static_cast<std::size_t>(std::ceil(static_cast<double>(samples.size()) * ratio)) + 1);
    SRC_DATA data{};
    data.data_in = samples.data();
    data.input_frames = static_cast<long>(samples.size());
    data.data_out = result.data();
    data.output_frames = static_cast<long>(result.size());
    data.src_ratio = ratio;
    if (const int error = src_simple(&data, SRC_SINC_BEST_QUALITY, 1); error != 0)
        fail_at(place, std::string("a sample that libsamplerate refuses: ") + src_strerror(error),
                "tuning within 256 times");
    result.resize(static_cast<std::size_t>(data.output_frames_gen));
    return result;
}

/// The region's envelope n samples after its start, the delay behind it: attack linear, decay linear in dB to the
/// sustain (which counts as -80 dB where it is 0).
class Envelope {
public:
    explicit Envelope(const WrittenRegion& r)
        : attack_(r.ampeg_attack * kSampleRate),
          hold_(attack_ + r.ampeg_hold * kSampleRate),
          decay_(r.ampeg_decay * kSampleRate),
          sustain_(r.ampeg_sustain / 100) {}
    [[nodiscard]] double at(std::size_t n) const {
        const auto x = static_cast<double>(n);
        if (x < attack_) return x / attack_;
        if (x < hold_ || sustain_ >= 1) return 1;
        const double share = decay_ > 0 ? (x - hold_) / decay_ : 1;
        if (share >= 1) return sustain_;
        return std::pow(std::max(sustain_, 1e-4), share);
    }

private:
    double attack_, hold_, decay_, sustain_;
};

/// Gains of both sides by SFZ's pan, constant power; 1 and 1 in the middle.
std::pair<double, double> balance(double pan) {
    const double angle = (pan / 100 + 1) * std::numbers::pi / 4;
    return {std::numbers::sqrt2 * std::cos(angle), std::numbers::sqrt2 * std::sin(angle)};
}

class SetMaker {
public:
    explicit SetMaker(SampleSet& set) : set_(set) {}

    void add(const WrittenRegion& r, int key, bool every_key) {
        const Recording& recording = recording_of(r);
        for (const ChannelUse& use : channels_of(r, recording)) {
            SampleRegion region;
            region.key = every_key ? -1 : key;
            region.low_velocity = r.lovel, region.high_velocity = r.hivel;
            region.low_random = r.lorand, region.high_random = r.hirand >= 1 ? 2 : r.hirand;
            region.sequence_length = r.seq_length, region.sequence_position = r.seq_position;
            region.velocity_track = r.amp_veltrack / 100;
            const auto [left, right] = balance(r.pan);
            const double gain = std::pow(10, r.volume / 20) * r.amplitude / 100;
            region.left = gain * left * use.left, region.right = gain * right * use.right;
            region.wave = static_cast<std::uint32_t>(set_.waves.size());
            set_.waves.push_back(wave_of(r, recording, use.channel, key));
            region.frames = static_cast<std::uint32_t>(set_.waves.back().size());
            set_.waves.back().resize(set_.waves.back().size() +
                                     static_cast<std::size_t>(kGuardS * kSampleRate));
            frames_ += set_.waves.back().size();
            if (frames_ > kMostSampleFrames)
                fail_at(r.place, "more than " + std::to_string(kMostSampleFrames) + " frames of samples",
                        "less sound for one instrument");
            set_.regions.push_back(region);
        }
    }

private:
    const Recording& recording_of(const WrittenRegion& r) {
        if (r.recording) return *r.recording;
        const auto known = recordings_.find(r.sample);
        if (known != recordings_.end()) return known->second;
        set_.files.push_back(r.sample);
        const Recording& read = recordings_.emplace(r.sample, read_sound(r.sample, r.place)).first->second;
        if ((read_ += read.channels.size() * read.channels.front().size()) > kMostSampleFrames)
            fail_at(r.place, "more than " + std::to_string(kMostSampleFrames) + " samples in the files",
                    "less sound for one instrument");
        return read;
    }
    static std::vector<ChannelUse> channels_of(const WrittenRegion& r, const Recording& recording) {
        for (const ChannelUse& use : r.channels)
            if (use.channel < 0 || use.channel >= std::ssize(recording.channels))
                fail_at(r.place,
                        "channel " + std::to_string(use.channel + 1) + " of a sample of " +
                            std::to_string(recording.channels.size()),
                        "one that it has");
        if (!r.channels.empty()) return r.channels;
        if (recording.channels.size() == 1) return {{0, 1, 1}};
        return {{0, 1, 0}, {1, 0, 1}};
    }
    static std::vector<float> wave_of(const WrittenRegion& r, const Recording& recording, int channel,
                                      int key) {
        const std::vector<float>& all = recording.channels[static_cast<std::size_t>(channel)];
        const auto length = static_cast<std::int64_t>(all.size());
        const std::int64_t end = r.end < 0 ? length : std::min(length, r.end + 1);
        if (r.offset >= end)
            fail_at(r.place,
                    "offset " + std::to_string(r.offset) + " of a sample that ends at frame " +
                        std::to_string(end),
                    "one before its end");
        const double cents = r.tune + 100 * r.transpose + r.pitch_keytrack * (key - r.pitch_keycenter);
        const double ratio = kSampleRate / recording.rate_hz / std::exp2(cents / 1200);
        if (!(ratio > 1.0 / 250 && ratio < 250) ||
            static_cast<double>(end - r.offset) * ratio > 2 * kLongestSampleS * kSampleRate)
            fail_at(r.place, "a tuning of " + std::to_string(cents) + " cents", "less");
        std::vector<float> wave = resampled({all.begin() + r.offset, all.begin() + end}, ratio, r.place);
        const Envelope envelope(r);
        for (std::size_t i = 0; i < wave.size(); ++i) wave[i] *= static_cast<float>(envelope.at(i));
        const auto delay = static_cast<std::size_t>(std::lround((r.delay + r.ampeg_delay) * kSampleRate));
        wave.insert(wave.begin(), delay, 0.0F);
        return wave;
    }

    SampleSet& set_;
    std::map<fs::path, Recording> recordings_;
    std::size_t frames_ = 0, read_ = 0;
};

std::string lower_extension(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 'a' - 'A');
    return extension;
}

/// A sound file alone: one region for all keys, at its own pitch.
WrittenRegions single(const fs::path& file) {
    WrittenRegion r;
    r.sample = file;
    r.place = file.string();
    r.pitch_keytrack = 0;
    return {{r}, {}, {}};
}

WrittenRegions written_regions(const fs::path& file, const std::string& extension) {
    if (extension == ".sfz") return parse_sfz(read_region_file(file), file);
    if (extension == ".sf2") return parse_sf2(bytes_of(file, kLargestSoundFont, ""), file);
    if (extension == ".xml") return parse_drumgizmo(read_region_file(file), file);
    return single(file);
}

std::string keys_text(const WrittenRegions& written) {
    int low = 127, high = 0;
    for (const WrittenRegion& r : written.regions)
        low = std::min(low, r.lokey), high = std::max(high, r.hikey);
    return std::to_string(low) + " to " + std::to_string(high);
}

}  // namespace

std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 80;
    std::string result(text.substr(0, kLongest));
    for (char& c : result)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return text.size() > kLongest ? result + "..." : result;
}

void fail_at(const std::string& place, const std::string& found, const std::string& expected) {
    throw SampleError(place + ": error: found " + found + ", expected " + expected);
}

std::string read_region_file(const fs::path& file, const std::string& place) {
    return bytes_of(file, kLargestRegionFile, place);
}

std::shared_ptr<const SampleSet> read_samples(const fs::path& file, std::span<const int> keys) {
    const std::string extension = lower_extension(file);
    const bool alone = extension != ".sfz" && extension != ".sf2" && extension != ".xml";
    WrittenRegions written = written_regions(file, extension);
    auto set = std::make_shared<SampleSet>();
    set->files = written.files;
    set->ignored = written.ignored;
    SetMaker maker(*set);
    const std::set<int> each(keys.begin(), keys.end());
    for (const int key : each) {
        bool any = false;
        for (const WrittenRegion& r : written.regions) {
            if (key < r.lokey || key > r.hikey) continue;
            any = true;
            maker.add(r, key, alone);
            if (r.group != 0 && r.group == r.off_by)
                set->choke_group = file.string() + " group " + std::to_string(r.group);
        }
        if (!any && key == keys.front())
            fail_at(file.string() + ":1:1", "no sound for MIDI note " + std::to_string(key),
                    "a zone's midi_note among its keys, " + keys_text(written));
        if (!any) set->stand_ins.emplace_back(key, keys.front());
        if (alone) break;
    }
    return set;
}

int stroke_velocity(double speed_mps) noexcept {
    return static_cast<int>(std::clamp(std::round(127 * std::pow(speed_mps / 8, 0.7)), 1.0, 127.0));
}

double stroke_random(std::int64_t onset_sample, std::uint32_t voice) noexcept {
    std::uint64_t x = static_cast<std::uint64_t>(onset_sample) * 0x9e3779b97f4a7c15U + voice + 1;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    x ^= x >> 31;
    return static_cast<double>(x >> 11) * 0x1p-53;
}

std::shared_ptr<const ImpulseResponse> read_impulse_response(const fs::path& file) {
    const std::string place = file.string() + ":1:1";
    const Recording recording = read_sound(file, place);
    const std::size_t channels = recording.channels.size();
    if (channels != 1 && channels != 2 && channels != 4)
        fail_at(place, std::to_string(channels) + " channels", "an impulse response of 1, 2 or 4");
    if (static_cast<double>(recording.channels[0].size()) > kLongestImpulseS * recording.rate_hz)
        fail_at(
            place,
            std::to_string(static_cast<double>(recording.channels[0].size()) / recording.rate_hz) + " s",
            "an impulse response of at most " + std::to_string(static_cast<int>(kLongestImpulseS)) + " s");
    const auto silent = [](const std::vector<float>& samples) {
        return std::ranges::all_of(samples, [](float x) { return std::abs(x) < 1e-6F; });
    };
    if (std::ranges::all_of(recording.channels, silent)) fail_at(place, "silence", "an impulse response");
    auto response = std::make_shared<ImpulseResponse>();
    const double ratio = kSampleRate / static_cast<double>(recording.rate_hz);
    const auto channel = [&](std::size_t i) { return resampled(recording.channels[i], ratio, place); };
    auto& from_to = response->from_to;
    from_to[0][0] = channel(0);
    from_to[1][1] = channel(channels - 1);
    for (const auto& [from, to] : {std::pair(0, 1), std::pair(1, 0)})
        from_to[from][to] = channels == 4 ? channel(static_cast<std::size_t>(2 * from + to))
                                          : std::vector<float>(response->size(), 0.0F);
    return response;
}

}  // namespace audio
