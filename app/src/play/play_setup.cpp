#include "play/play_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/checksum.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestHours = 3;

/// 0 at the centre of the struck zone, 1 at its edge: along a string, else by the radius about the body's
/// axis.
double place_of(const Strike& strike, const Instrument& instrument) {
    const Eigen::Vector3d unit = strike.point_body.cwiseQuotient(instrument.body.shape.semi_axes);
    if (instrument.kind == "string") return std::clamp(std::abs(unit.x()), 0.0, 1.0);
    const sim::Zone& zone = instrument.body.zones[static_cast<std::size_t>(strike.zone)];
    const double outer = std::min(1.0, zone.max_radius);
    const double radius = std::hypot(unit.x(), unit.z());
    return std::clamp((radius - zone.min_radius) / std::max(1e-6, outer - zone.min_radius), 0.0, 1.0);
}

}  // namespace

tracking::Trace read_played_trace(const fs::path& file) {
    tracking::Trace trace = tracking::read_trace(file);
    if (const double hours = (trace.t_end_s() - trace.t0_s()) / 3600; hours > kLongestHours)
        throw BadInput(fmt::format(
            "{}: error: found {:.3g} hours between the first sample and the last, expected at most {}; "
            "are there two clocks in it?",
            file.string(), hours, kLongestHours));
    return trace;
}

std::vector<audio::Voice> voices_of(const Kit& kit) {
    std::vector<audio::Voice> voices;
    for (const Instrument& instrument : kit.instruments) voices.push_back(instrument.voice);
    return voices;
}

audio::Note note_of(const Strike& strike, const Instrument& instrument) {
    audio::Note note;
    note.id = strike.id;
    note.voice = strike.instrument;
    note.onset_sample = strike.onset_sample;
    note.speed_mps = 5 * std::pow(strike.speed_mps / 5, instrument.velocity_gamma);
    note.place = place_of(strike, instrument);
    note.zone = strike.zone;
    note.midi_note = instrument.zones[static_cast<std::size_t>(strike.zone)].midi_note;
    note.midi_velocity =
        static_cast<int>(std::clamp(std::round(127 * std::pow(strike.speed_mps / 8, 0.7)), 1.0, 127.0));
    return note;
}

fs::path orchestra_file() {
    return assets_folder() / "orchestra" / "musicworld.orc";
}

std::unique_ptr<sim::Simulation> make_simulation(const Kit& kit, int workers) {
    if (workers == 0) return sim::make_local_simulation(bodies_of(kit));
    return sim::make_distributed_simulation(
        bodies_of(kit), {fs::read_symlink("/proc/self/exe").string(), {"worker"}, workers});
}

std::unique_ptr<FrameThread> start_frames(const PlayOptions& options,
                                          const std::vector<render::SceneDescription>& scenes,
                                          const render::FrameState& rest, const OutputFolder& folder,
                                          FramePolicy policy, bool realtime_priority) {
    if (!options.frames) return nullptr;
    const FrameThreadOptions where{options.width, options.height, folder.path("frames"), policy,
                                   realtime_priority};
    fs::create_directory(where.folder);
    return std::make_unique<FrameThread>(scenes, rest, where);
}

PlayResult describe(const PlayOptions& options, const tracking::Trace& trace, const Kit& kit,
                    bool trace_is_file) {
    PlayResult result;
    result.options = options;
    result.options.picture_predictor = picture_specification(options.picture_predictor);
    result.options.sound_predictor = sound_specification(options.sound_predictor);
    if (const std::string& sound = result.options.sound_predictor; !is_external(sound))
        result.sound_models = tracking::make_predictor(sound)->models();
    result.trace = trace.file;
    result.kit_name = kit.name;
    result.trace_source = trace.source;
    result.t0_s = trace.t0_s();
    result.t_end_s = trace.t_end_s();
    for (const tracking::StickTrace& stick : trace.sticks) result.sticks.push_back(stick.name);
    for (const Instrument& instrument : kit.instruments) result.instruments.push_back(instrument.name);
    if (trace_is_file) result.inputs.push_back({options.trace.string(), sha256_of_file(options.trace)});
    for (const fs::path& file : kit.files) result.inputs.push_back({file.string(), sha256_of_file(file)});
    return result;
}

}  // namespace app
