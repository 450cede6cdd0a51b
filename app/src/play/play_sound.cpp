#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "play/play_run.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kHighestPeakDbtp = -1;  // EBU R 128

std::string file_name(std::size_t instrument, std::string name) {
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
    constexpr std::size_t kLongest = 100;  // a file's name has at most 255 bytes
    if (name.size() > kLongest) name.resize(kLongest);
    return fmt::format("{:02}_{}.wav", instrument + 1, name);
}

/// The instrument's notes among all, by the samples that audio.wav has.
std::vector<float> stem(const PlayResult& result, const Kit& kit, std::uint32_t instrument) {
    audio::Mix mix{.gain_db = result.gain_db, .room = {}, .alone = instrument};
    audio::Performance performance(orchestra_file(), voices_of(kit), mix);
    for (const Strike& strike : result.strikes) {
        const bool heard = !result.options.solo || *result.options.solo == strike.id;
        if (strike.outcome == Outcome::released && heard)
            performance.schedule(note_of(strike, kit.instruments[strike.instrument]));
    }
    return performance.finish(static_cast<std::int64_t>(result.audio.size() / 2), 0);
}

}  // namespace

audio::Mix mix_of(const PlayOptions& options, const Kit& kit) {
    audio::Mix mix = kit.mix;
    mix.gain_db = options.mix.gain_db.value_or(mix.gain_db);
    return mix;
}

void set_loudness(PlayResult& result, const audio::Mix& mix, bool may_change) {
    const MixOptions& asked = result.options.mix;
    result.gain_db = mix.gain_db;
    result.loudness = audio::measure_loudness({result.audio.data(), result.audio.size()});
    // One note of a run keeps the level that it has among the others.
    if (!may_change || asked.gain_db || result.options.solo) return;
    const double gain_db = audio::gain_towards(result.loudness, asked.loudness_lufs, kHighestPeakDbtp);
    const auto gain = static_cast<float>(std::pow(10.0, gain_db / 20));
    for (float& sample : result.audio) sample *= gain;
    result.gain_db += gain_db;
    for (std::optional<double>* level : {&result.loudness.integrated_lufs, &result.loudness.true_peak_dbtp})
        if (*level) **level += gain_db;  // both are levels: what shifts the sound shifts them
}

void write_stems(const PlayResult& result, const Kit& kit, const OutputFolder& folder) {
    fs::create_directory(folder.path("stems"));
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        const auto sounds = [&](const Strike& strike) {
            return strike.instrument == i && strike.outcome == Outcome::released;
        };
        if (std::ranges::none_of(result.strikes, sounds)) continue;
        (void)audio::write_wav(folder.path("stems/" + file_name(i, kit.instruments[i].name)),
                               stem(result, kit, i));
    }
}

}  // namespace app
