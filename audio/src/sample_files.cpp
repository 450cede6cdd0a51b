#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>

#include "audio/performance.h"
#include "region_text.h"
#include "sample_waves.h"

namespace audio {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestSoundFont = std::size_t{512} << 20;  // bytes
constexpr int kMostChannels = 64;

bool is_file(const fs::path& file) {
    std::error_code error;
    return fs::is_regular_file(file, error);
}

std::string without_controls(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    return text;
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

/// libsndfile reads what there is of a WAV, AIFF or AU file whose samples end early, and notes it in its log as
/// "data : 96000 (should be 47978)". A length of all ones means that whoever wrote the file could not know it.
void require_whole(SNDFILE* sound, const std::string& name, const std::string& place) {
    std::array<char, 16384> log{};
    (void)sf_command(sound, SFC_GET_LOG_INFO, log.data(), static_cast<int>(log.size() - 1));
    std::istringstream lines(log.data());
    for (std::string line; std::getline(lines, line);) {
        constexpr std::string_view kShould = "(should be ";
        const std::size_t length = line.find(" : "), should = line.find(kShould);
        const bool samples =
            line.starts_with("data") || line.starts_with(" SSND") || line.starts_with("  Data Size");
        if (!samples || length == line.npos || should == line.npos) continue;
        const unsigned long long said = std::strtoull(line.c_str() + length + 3, nullptr, 10),
                                 there = std::strtoull(line.c_str() + should + kShould.size(), nullptr, 10);
        if (said > there && said != 0xffffffff)
            fail_at(
                place,
                name + " with " + std::to_string(there) + " of " + std::to_string(said) + " bytes of samples",
                "a whole file; copy it again, or `ffmpeg -i IN OUT` keeps what there is");
    }
}

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
    require_whole(sound.get(), name, place);
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
    SF_INSTRUMENT instrument{};
    if (sf_command(sound.get(), SFC_GET_INSTRUMENT, &instrument, sizeof instrument) == SF_TRUE &&
        instrument.loop_count > 0 && instrument.loops[0].mode != SF_LOOP_NONE &&
        instrument.loops[0].start < instrument.loops[0].end &&
        static_cast<sf_count_t>(instrument.loops[0].end) <= info.frames) {
        recording.loop_start = instrument.loops[0].start;
        recording.loop_end =
            std::int64_t{instrument.loops[0].end} - 1;  // libsndfile's is the first one behind
    }
    recording.channels.assign(channels, std::vector<float>(static_cast<std::size_t>(info.frames)));
    for (std::size_t i = 0; i < all.size(); ++i) recording.channels[i % channels][i / channels] = all[i];
    return recording;
}

/// Gains of both sides by SFZ's pan, constant power; 1 and 1 in the middle.
std::pair<double, double> balance(double pan) {
    const double angle = (pan / 100 + 1) * std::numbers::pi / 4;
    return {std::numbers::sqrt2 * std::cos(angle), std::numbers::sqrt2 * std::sin(angle)};
}

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
    r.loop_mode = LoopMode::none;
    return {{r}, {}, {}};
}

WrittenRegions written_regions(const fs::path& file) {
    const std::string extension = lower_extension(file);
    if (extension == ".sfz") return parse_sfz(read_region_file(file), file);
    if (extension == ".sf2") return parse_sf2(bytes_of(file, kLargestSoundFont, ""), file);
    if (extension == ".xml") return parse_drumgizmo(read_region_file(file), file);
    return single(file);
}

/// Everything that makes two waves differ.
using WaveKey = std::tuple<const Recording*, int, int, std::array<double, 12>>;
WaveKey wave_key(const WrittenRegion& r, const Recording& recording, int channel, int key) {
    return {&recording,
            channel,
            static_cast<int>(r.loop_mode),
            {static_cast<double>(r.offset), static_cast<double>(r.end), static_cast<double>(r.loop_start),
             static_cast<double>(r.loop_end), tuning_cents(r, key), r.delay, r.ampeg_delay, r.ampeg_attack,
             r.ampeg_hold, r.ampeg_decay, r.ampeg_sustain, r.ampeg_release}};
}

}  // namespace

/// A kit's.
class SampleLibrary::Contents {
public:
    const Recording& recording(const fs::path& file, const std::string& place) {
        const auto known = recordings_.find(file);
        if (known != recordings_.end()) return known->second;
        const Recording& read = recordings_.emplace(file, read_sound(file, place)).first->second;
        if ((read_ += read.channels.size() * read.frames()) > kMostSampleFrames)
            fail_at(place, "more than " + std::to_string(kMostSampleFrames) + " samples in the kit's files",
                    "less sound");
        return read;
    }
    std::shared_ptr<const std::vector<float>> wave(const WrittenRegion& r, const Recording& recording,
                                                   int channel, int key) {
        std::shared_ptr<const std::vector<float>>& known = waves_[wave_key(r, recording, channel, key)];
        if (known) return known;
        Wave made = make_wave(r, recording, channel, key);
        known = std::make_shared<const std::vector<float>>(std::move(made.samples));
        if ((made_ += std::max(made.cut_frames, known->size())) > kMostSampleFrames)
            fail_at(r.place,
                    "more than " + std::to_string(kMostSampleFrames) + " frames of samples in the kit",
                    "less sound");
        return known;
    }
    const WrittenRegions& regions(const fs::path& file) {
        const auto known = written_.find(file);
        return known != written_.end() ? known->second
                                       : written_.emplace(file, written_regions(file)).first->second;
    }

private:
    std::map<fs::path, Recording> recordings_;
    std::map<fs::path, WrittenRegions> written_;
    std::map<WaveKey, std::shared_ptr<const std::vector<float>>> waves_;
    std::size_t read_ = 0, made_ = 0;
};

SampleLibrary::SampleLibrary() : contents_(std::make_unique<Contents>()) {}
SampleLibrary::~SampleLibrary() = default;

namespace {

class SetMaker {
public:
    SetMaker(SampleSet& set, SampleLibrary::Contents& library) : set_(set), library_(library) {}

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
            const std::shared_ptr<const std::vector<float>> wave =
                library_.wave(r, recording, use.channel, key);
            region.wave = static_cast<std::uint32_t>(set_.waves.size());
            region.frames = static_cast<std::uint32_t>(wave->size() - kWaveGuard);
            set_.waves.push_back(wave);
            set_.regions.push_back(region);
        }
    }

private:
    const Recording& recording_of(const WrittenRegion& r) {
        if (r.recording) return *r.recording;
        if (std::ranges::find(set_.files, r.sample) == set_.files.end()) set_.files.push_back(r.sample);
        return library_.recording(r.sample, r.place);
    }
    static std::vector<ChannelUse> channels_of(const WrittenRegion& r, const Recording& recording) {
        for (const ChannelUse& use : r.channels)
            if (use.channel < 0 || use.channel >= std::ssize(recording.channels))
                fail_at(r.place,
                        "channel " + std::to_string(use.channel + 1) + " of a sample of " +
                            std::to_string(recording.channels.size()),
                        "one that it has");
        if (!r.channels.empty()) return r.channels;
        if (recording.channels.size() > 2)
            fail_at(r.place, "a sample of " + std::to_string(recording.channels.size()) + " channels",
                    "one or two; `ffmpeg -i IN -ac 2 OUT` mixes them");
        if (recording.channels.size() == 1) return {{0, 1, 1}};
        return {{0, 1, 0}, {1, 0, 1}};
    }

    SampleSet& set_;
    SampleLibrary::Contents& library_;
};

/// The keyswitch that is down: the one asked for, else the file's default, else its lowest.
int switch_of(const WrittenRegions& written, const fs::path& file, std::optional<int> asked) {
    int lowest = -1;
    bool there = false;
    for (const WrittenRegion& r : written.regions) {
        if (r.sw_lolast < 0) continue;
        there = there || (asked && *asked >= r.sw_lolast && *asked <= r.sw_hilast);
        if (lowest < 0 || r.sw_lolast < lowest) lowest = r.sw_lolast;
    }
    if (asked && lowest >= 0 && !there)
        fail_at(file.string() + ":1:1", "no region with sw_last=" + std::to_string(*asked),
                "one of its keyswitches, the lowest is " + std::to_string(lowest));
    return asked.value_or(written.sw_default >= 0 ? written.sw_default : lowest);
}

std::string keys_text(const WrittenRegions& written) {
    int low = 127, high = 0;
    for (const WrittenRegion& r : written.regions)
        low = std::min(low, r.lokey), high = std::max(high, r.hikey);
    return std::to_string(low) + " to " + std::to_string(high);
}

}  // namespace

SampleError::SampleError(std::string text) : std::runtime_error(without_controls(std::move(text))) {}

std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 80;
    const std::string result = without_controls(std::string(text.substr(0, kLongest)));
    return text.size() > kLongest ? result + "..." : result;
}

void fail_at(const std::string& place, const std::string& found, const std::string& expected) {
    throw SampleError(place + ": error: found " + found + ", expected " + expected);
}

std::string read_region_file(const fs::path& file, const std::string& place) {
    return bytes_of(file, kLargestRegionFile, place);
}

std::shared_ptr<const SampleSet> read_samples(const fs::path& file, std::span<const int> keys,
                                              SampleLibrary& library, std::optional<int> keyswitch) {
    const std::string extension = lower_extension(file);
    const bool alone = extension != ".sfz" && extension != ".sf2" && extension != ".xml";
    SampleLibrary::Contents& contents = library.contents();
    const WrittenRegions& written = contents.regions(file);
    const int down = switch_of(written, file, keyswitch);
    auto set = std::make_shared<SampleSet>();
    set->files = written.files;
    set->ignored = written.ignored;
    const auto has_switch = [](const WrittenRegion& r) { return r.sw_lolast >= 0; };
    if (keyswitch && std::ranges::none_of(written.regions, has_switch))
        set->ignored.emplace_back("keyswitch of the kit, as the file has none");
    SetMaker maker(*set, contents);
    const std::set<int> each(keys.begin(), keys.end());
    for (const int key : each) {
        bool any = false;
        for (const WrittenRegion& r : written.regions) {
            if (key < r.lokey || key > r.hikey ||
                (r.sw_lolast >= 0 && (down < r.sw_lolast || down > r.sw_hilast)))
                continue;
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
    double energy = 0;
    for (const auto& paths : from_to)
        for (const std::vector<float>& path : paths)
            for (const float x : path) energy += static_cast<double>(x) * x;
    if (energy < 1e-12) fail_at(place, "no sound at 48 kHz", "an impulse response");
    return response;
}

}  // namespace audio
