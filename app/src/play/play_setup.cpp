#include "play/play_setup.h"

#include <fmt/format.h>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/checksum.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestHours = 3;

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

StrikeRules strike_rules(const PlayOptions& options, double t0_s) {
    StrikeRules rules;
    rules.t0_s = t0_s;
    rules.release_margin_s = rules.commit_lead_s = options.release_margin_s;
    rules.cancelling = options.cancelling;
    return rules;
}

std::vector<sim::BodyDefinition> bodies_of(const Kit& kit) {
    std::vector<sim::BodyDefinition> bodies;
    for (const Instrument& instrument : kit.instruments) bodies.push_back(instrument.body);
    return bodies;
}

std::vector<audio::Voice> voices_of(const Kit& kit) {
    std::vector<audio::Voice> voices;
    for (const Instrument& instrument : kit.instruments) voices.push_back(instrument.voice);
    return voices;
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
    result.trace = trace.file;
    result.kit = options.kit.string();
    result.kit_name = kit.name;
    result.trace_source = trace.source;
    result.picture_predictor = picture_specification(options.picture_predictor);
    result.sound_predictor = sound_specification(options.sound_predictor);
    if (!is_external(result.sound_predictor))
        result.sound_models = tracking::make_predictor(result.sound_predictor)->models();
    result.t0_s = trace.t0_s();
    result.t_end_s = trace.t_end_s();
    result.fps = options.fps;
    result.render_lead_s = options.render_lead_s;
    result.sound_lead_s = options.sound_lead_s;
    result.release_margin_s = options.release_margin_s;
    result.cancelling = options.cancelling;
    result.width = options.width;
    result.height = options.height;
    result.workers = options.workers;
    for (const tracking::StickTrace& stick : trace.sticks) result.sticks.push_back(stick.name);
    for (const Instrument& instrument : kit.instruments) result.instruments.push_back(instrument.name);
    if (trace_is_file) result.inputs.push_back({options.trace.string(), sha256_of_file(options.trace)});
    for (const fs::path& file : kit.files) result.inputs.push_back({file.string(), sha256_of_file(file)});
    return result;
}

}  // namespace app
