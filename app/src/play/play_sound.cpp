#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "play/play_run.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kHighestPeakDbtp = -1;  // EBU R 128

std::string file_name(std::size_t number, std::string name) {
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
    constexpr std::size_t kLongest = 100;  // a file's name has at most 255 bytes
    if (name.size() > kLongest) name.resize(kLongest);
    return fmt::format("{:02}_{}.wav", number + 1, name);
}

/// The run's notes mixed otherwise, by the samples that audio.wav has.
std::vector<float> mixed(const PlayResult& result, const Kit& kit, const audio::Mix& mix) {
    audio::Performance performance(orchestra_file(), voices_of(kit), mix);
    for (const audio::Note& note : notes_of(result, kit)) performance.schedule(note);
    return performance.finish(static_cast<std::int64_t>(result.sound.samples.size() / 2), 0);
}

}  // namespace

audio::Mix mix_of(const PlayOptions& options, const Kit& kit) {
    audio::Mix mix = kit.mix;
    mix.gain_db = options.mix.gain_db.value_or(mix.gain_db);
    return mix;
}

void set_loudness(RunSound& sound, const MixOptions& asked, const audio::Mix& mix, bool may_change) {
    sound.gain_db = mix.gain_db;
    sound.loudness = audio::measure_loudness({sound.samples.data(), sound.samples.size()});
    if (!may_change || asked.gain_db) return;
    const double gain_db = audio::gain_towards(sound.loudness, asked.loudness_lufs, kHighestPeakDbtp);
    const auto gain = static_cast<float>(std::pow(10.0, gain_db / 20));
    for (float& sample : sound.samples) sample *= gain;
    sound.gain_db += gain_db;
    for (std::optional<double>* level : {&sound.loudness.integrated_lufs, &sound.loudness.true_peak_dbtp})
        if (*level) **level += gain_db;  // both are levels: what shifts the sound shifts them
}

void keep_solo(PlayResult& result, const Kit& kit, const audio::Mix& mix) {
    audio::Mix alone = mix;
    alone.alone_note = result.options.solo;
    const auto gain = static_cast<float>(std::pow(10.0, (result.sound.gain_db - mix.gain_db) / 20));
    const std::vector<float> sound = mixed(result, kit, alone);
    std::ranges::transform(sound, result.sound.samples.begin(),
                           [gain](float sample) { return sample * gain; });
    result.sound.loudness =
        audio::measure_loudness({result.sound.samples.data(), result.sound.samples.size()});
}

void write_stems(const PlayResult& result, const Kit& kit, const OutputFolder& folder) {
    fs::create_directory(folder.path("stems"));
    const std::vector<audio::Note> notes = notes_of(result, kit);
    const auto write = [&](const std::string& name, const std::vector<std::uint32_t>& instruments) {
        const auto sounds = [&](const audio::Note& note) {
            return note.kind == audio::Note::Kind::stroke &&
                   std::ranges::find(instruments, note.voice) != instruments.end();
        };
        if (std::ranges::none_of(notes, sounds)) return;
        audio::Mix mix;
        mix.gain_db = result.sound.gain_db;
        mix.alone = instruments;
        (void)audio::write_wav(folder.path("stems/" + name), mixed(result, kit, mix));
    };
    const auto count = static_cast<std::uint32_t>(kit.instruments.size());
    for (std::uint32_t i = 0; i < count && result.options.mix.stems; ++i)
        write(file_name(i, kit.instruments[i].name), {i});
    for (std::size_t bus = 0; bus < kit.buses.size() && result.options.mix.bus_stems; ++bus) {
        std::vector<std::uint32_t> instruments;
        for (std::uint32_t i = 0; i < count; ++i)
            if (kit.instruments[i].bus == kit.buses[bus].name) instruments.push_back(i);
        write(file_name(count + bus, "bus_" + kit.buses[bus].name), instruments);
    }
}

}  // namespace app
