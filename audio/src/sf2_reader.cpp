#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "region_text.h"

namespace audio {
namespace {

// SoundFont 2.04: RIFF "sfbk" with LIST sdta (smpl: 16-bit samples) and LIST pdta (tables of presets, instruments,
// generators and sample headers). Section numbers of the specification are given.

constexpr std::size_t kMostZones = 1 << 16;

/// Generators of 8.1.2 that are followed.
enum Generator {
    start_offset = 0,
    end_offset = 1,
    start_loop = 2,
    end_loop = 3,
    start_coarse = 4,
    end_coarse = 12,
    pan = 17,
    delay_volume = 33,
    attack_volume = 34,
    hold_volume = 35,
    decay_volume = 36,
    sustain_volume = 37,
    release_volume = 38,
    instrument = 41,
    key_range = 43,
    velocity_range = 44,
    start_loop_coarse = 45,
    attenuation = 48,
    end_loop_coarse = 50,
    coarse_tune = 51,
    fine_tune = 52,
    sample_id = 53,
    sample_modes = 54,
    scale_tuning = 56,
    exclusive_class = 57,
    root_key = 58,
};

using Generators = std::map<int, int>;  // amount as it lies there, 0 to 65535

int signed16(int amount) {
    return amount >= 32768 ? amount - 65536 : amount;
}

class Table {
public:
    Table() = default;
    Table(std::string_view bytes, std::size_t record) : bytes_(bytes), record_(record) {}
    [[nodiscard]] std::size_t size() const { return record_ == 0 ? 0 : bytes_.size() / record_; }
    [[nodiscard]] int word(std::size_t row, std::size_t at) const {
        const auto byte = [&](std::size_t i) {
            return static_cast<unsigned char>(bytes_[row * record_ + i]);
        };
        return byte(at) | byte(at + 1) << 8;
    }
    [[nodiscard]] std::uint32_t dword(std::size_t row, std::size_t at) const {
        return static_cast<std::uint32_t>(word(row, at)) | static_cast<std::uint32_t>(word(row, at + 2))
                                                               << 16;
    }
    [[nodiscard]] int byte(std::size_t row, std::size_t at) const {
        return static_cast<unsigned char>(bytes_[row * record_ + at]);
    }

private:
    std::string_view bytes_;
    std::size_t record_ = 0;
};

class SoundFont {
public:
    SoundFont(std::string_view bytes, const std::filesystem::path& file)
        : bytes_(bytes), place_(file.string()) {
        if (bytes.size() < 12 || bytes.substr(0, 4) != "RIFF" || bytes.substr(8, 4) != "sfbk")
            fail("no RIFF sfbk header", "a SoundFont 2 file");
        chunks(bytes.substr(12), 12, true);
        for (const char* name : {"phdr", "pbag", "pgen", "inst", "ibag", "igen", "shdr"})
            if (table(name).size() < 2) fail(std::string("no table ") + name, "its records and the last one");
    }

    WrittenRegions regions() {
        const std::size_t preset = chosen_preset();
        const Table &phdr = table("phdr"), &pbag = table("pbag");
        Generators global;
        for (const auto& [first, zone] : zones(phdr, 24, preset, pbag, table("pgen"))) {
            if (!zone.contains(instrument)) {
                if (first) global = zone;
                continue;
            }
            Generators all = zone;
            all.insert(global.begin(), global.end());
            add_instrument(all, static_cast<std::size_t>(zone.at(instrument)));
        }
        if (result_.regions.empty()) fail("a preset without samples", "one that sounds");
        return std::move(result_);
    }

private:
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
        fail_at(place_, found, expected);
    }
    [[nodiscard]] std::uint32_t length_at(std::string_view bytes, std::size_t at) const {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i)
            value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
        return value;
    }
    void chunks(std::string_view bytes, std::size_t from, bool outer) {
        static const std::map<std::string, std::size_t, std::less<>> kRecords = {
            {"phdr", 38}, {"pbag", 4}, {"pgen", 4}, {"inst", 22}, {"ibag", 4}, {"igen", 4}, {"shdr", 46}};
        for (std::size_t at = 0; at + 8 <= bytes.size();) {
            const std::string name(bytes.substr(at, 4));
            const std::size_t length = length_at(bytes, at + 4);
            if (length > bytes.size() - at - 8)
                fail_at(place_,
                        "chunk \"" + printable(name) + "\" of " + std::to_string(length) + " bytes at byte " +
                            std::to_string(from + at),
                        "one that ends within the file");
            const std::string_view inner = bytes.substr(at + 8, length);
            if (outer && name == "LIST" && length >= 4) chunks(inner.substr(4), from + at + 12, false);
            if (!outer && name == "smpl") samples_ = inner;
            if (const auto record = kRecords.find(name); !outer && record != kRecords.end())
                tables_[name] = Table(inner, record->second);
            at += 8 + length + length % 2;
        }
    }
    const Table& table(const std::string& name) { return tables_[name]; }

    /// The first preset of bank 128 (drums), else the first of all.
    std::size_t chosen_preset() {
        const Table& phdr = table("phdr");
        for (std::size_t i = 0; i + 1 < phdr.size(); ++i)
            if (phdr.word(i, 22) == 128) return i;
        return 0;
    }

    /// The zones of a preset or an instrument: generators, and whether each is the first.
    std::vector<std::pair<bool, Generators>> zones(const Table& headers, std::size_t at, std::size_t row,
                                                   const Table& bags, const Table& generators) {
        std::vector<std::pair<bool, Generators>> result;
        const auto begin = static_cast<std::size_t>(headers.word(row, at)),
                   end = static_cast<std::size_t>(headers.word(row + 1, at));
        if (begin > end || end >= bags.size()) fail("zones out of range", "indices within the tables");
        for (std::size_t bag = begin; bag < end; ++bag) {
            const auto first = static_cast<std::size_t>(bags.word(bag, 0)),
                       last = static_cast<std::size_t>(bags.word(bag + 1, 0));
            if (first > last || last >= generators.size())
                fail("generators out of range", "indices within the tables");
            if ((count_ += last - first + 1) > kMostZones) fail("too many generators", "at most 65536");
            Generators all;
            for (std::size_t i = first; i < last; ++i) all[generators.word(i, 0)] = generators.word(i, 2);
            result.emplace_back(bag == begin, std::move(all));
        }
        return result;
    }

    void add_instrument(const Generators& preset, std::size_t number) {
        const Table &inst = table("inst"), &ibag = table("ibag");
        if (number + 1 >= inst.size()) fail("instrument " + std::to_string(number), "one that there is");
        Generators global;
        for (const auto& [first, zone] : zones(inst, 20, number, ibag, table("igen"))) {
            if (!zone.contains(sample_id)) {
                if (first) global = zone;
                continue;
            }
            Generators all = zone;
            all.insert(global.begin(), global.end());
            add_region(preset, all);
        }
    }

    static int amount(const Generators& all, int generator, int otherwise) {
        const auto found = all.find(generator);
        return found == all.end() ? otherwise : found->second;
    }
    /// What the preset adds to the instrument's value (9.4).
    static double sum(const Generators& preset, const Generators& zone, int generator, int otherwise = 0) {
        const auto value = [&](const Generators& all, int missing) {
            const auto found = all.find(generator);
            return found == all.end() ? missing : signed16(found->second);
        };
        return value(zone, otherwise) + value(preset, 0);
    }
    /// Seconds of a time in timecents.
    static double seconds(double timecents) { return timecents <= -12000 ? 0 : std::exp2(timecents / 1200); }

    void add_region(const Generators& preset, const Generators& zone) {
        const Table& shdr = table("shdr");
        const auto number = static_cast<std::size_t>(zone.at(sample_id));
        if (number + 1 >= shdr.size()) fail("sample " + std::to_string(number), "one that there is");
        if (result_.regions.size() >= kMostRegions)
            fail("more than " + std::to_string(kMostRegions) + " zones", "fewer");
        WrittenRegion r;
        r.place = place_;
        const auto limits = [&](int generator, int& low, int& high) {
            for (const Generators* all : {&preset, &zone}) {
                const int range = amount(*all, generator, 127 << 8);
                low = std::max(low, range & 0xff), high = std::min(high, range >> 8);
            }
        };
        limits(key_range, r.lokey, r.hikey);
        limits(velocity_range, r.lovel, r.hivel);
        if (r.lokey > r.hikey || r.lovel > r.hivel) return;
        const int root = amount(zone, root_key, 65535);
        r.pitch_keycenter = root <= 127 ? root : std::min(shdr.byte(number, 40), 127);
        r.pitch_keytrack = std::clamp(sum(preset, zone, scale_tuning, 100), 0.0, 1200.0);
        const auto correction = static_cast<signed char>(shdr.byte(number, 41));
        r.tune = std::clamp(sum(preset, zone, fine_tune), -99.0, 99.0) + correction;
        r.transpose = std::clamp(sum(preset, zone, coarse_tune), -120.0, 120.0);
        r.pan = std::clamp(sum(preset, zone, pan) / 5, -100.0, 100.0);
        r.volume = -std::clamp(sum(preset, zone, attenuation), 0.0, 1440.0) / 10;
        const auto time = [&](int generator) {
            return seconds(std::clamp(sum(preset, zone, generator, -12000), -12000.0, 8000.0));
        };
        r.ampeg_delay = std::min(time(delay_volume), 10.0);
        r.ampeg_attack = time(attack_volume), r.ampeg_hold = time(hold_volume);
        // Of a fall by 100 dB, of which the sustain is a part (SoundFont 2.04, 8.1.2).
        const double sustain_centibels = std::clamp(sum(preset, zone, sustain_volume), 0.0, 1000.0);
        r.ampeg_decay = time(decay_volume) * sustain_centibels / 1000;
        r.ampeg_sustain =
            100 * std::pow(10, -std::clamp(sum(preset, zone, sustain_volume), 0.0, 1440.0) / 200);
        r.ampeg_release = std::min(time(release_volume), 100.0) * 0.8;  // by 80 of the 100 dB that it means
        const int modes = amount(zone, sample_modes, 0) & 3;
        r.loop_mode = modes == 1 ? LoopMode::continuous : modes == 3 ? LoopMode::sustain : LoopMode::none;
        r.group = r.off_by = amount(zone, exclusive_class, 0);
        cut(r, zone, number);
        result_.regions.push_back(std::move(r));
    }

    /// The recording of the sample header, with the zone's offsets.
    void cut(WrittenRegion& r, const Generators& zone, std::size_t number) {
        const Table& shdr = table("shdr");
        const auto offset = [&](int fine, int coarse) {
            return signed16(amount(zone, fine, 0)) + 32768 * std::int64_t{signed16(amount(zone, coarse, 0))};
        };
        const std::int64_t begin = shdr.dword(number, 20), end = shdr.dword(number, 24);
        const auto available = static_cast<std::int64_t>(samples_.size() / 2);
        const std::uint32_t rate = shdr.dword(number, 36);
        if (begin >= end || end > available || (shdr.word(number, 44) & 0x8000) != 0)
            fail("sample " + std::to_string(number) + " at " + std::to_string(begin) + " to " +
                     std::to_string(end) + " of " + std::to_string(available),
                 "samples within the file");
        if (rate < 1000 || rate > 768000 || static_cast<double>(end - begin) > kLongestSampleS * rate)
            fail("sample " + std::to_string(number) + " of " + std::to_string(end - begin) + " frames at " +
                     std::to_string(rate) + " Hz",
                 "at most 300 s, 1000 to 768000 Hz");
        r.offset = std::clamp<std::int64_t>(offset(start_offset, start_coarse), 0, end - begin - 1);
        r.end = std::clamp<std::int64_t>(end - begin + offset(end_offset, end_coarse), r.offset + 1,
                                         end - begin) -
                1;
        if (r.loop_mode != LoopMode::none) {
            r.loop_start = shdr.dword(number, 28) - begin + offset(start_loop, start_loop_coarse);
            r.loop_end = shdr.dword(number, 32) - begin + offset(end_loop, end_loop_coarse) - 1;
            // Files of one-shot sounds often leave these at 0.
            if (r.loop_start < 0 || r.loop_end < r.loop_start || r.loop_end > r.end)
                r.loop_mode = LoopMode::none;
        }
        std::shared_ptr<const Recording>& known = recordings_[number];
        if (!known) known = recording(begin, end, rate);
        r.recording = known;
    }
    std::shared_ptr<const Recording> recording(std::int64_t begin, std::int64_t end, std::uint32_t rate) {
        if ((frames_ += static_cast<std::size_t>(end - begin)) > kMostSampleFrames)
            fail("more than " + std::to_string(kMostSampleFrames) + " frames in one preset", "fewer");
        auto sound = std::make_shared<Recording>();
        sound->rate_hz = rate;
        std::vector<float>& channel = sound->channels.emplace_back();
        const Table words(samples_, 2);
        for (std::int64_t i = begin; i < end; ++i)
            channel.push_back(static_cast<float>(signed16(words.word(static_cast<std::size_t>(i), 0))) /
                              32768.0F);
        return sound;
    }

    std::string_view bytes_, samples_;
    std::string place_;
    std::map<std::string, Table> tables_;
    std::map<std::size_t, std::shared_ptr<const Recording>> recordings_;
    std::size_t count_ = 0, frames_ = 0;
    WrittenRegions result_;
};

}  // namespace

WrittenRegions parse_sf2(std::string_view bytes, const std::filesystem::path& file) {
    WrittenRegions written = SoundFont(bytes, file).regions();
    written.files = {file};
    return written;
}

}  // namespace audio
