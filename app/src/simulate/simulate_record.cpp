#include "simulate/simulate_record.h"

#include "pictures/video.h"
#include "play/play_products.h"
#include "process/clock.h"

namespace app {
namespace fs = std::filesystem;

SimulateRecord::SimulateRecord(const SimulateOptions& options, const Scene& scene)
    : options_(options), scene_(scene) {
    if (options.out) folder_ = std::make_unique<OutputFolder>(*options.out, simulate_products());
}

void SimulateRecord::start(const sim::World& world) {
    if (!folder_) return;
    const auto table = [&](const char* name, const std::string& header) {
        return std::make_unique<GrowingTable>(folder_->path(name), header);
    };
    states_ = table("states.csv", states_header());
    energy_ = table("energy.csv", energy_header() + energy_row(world, !options_.workers));
    if (options_.workers)
        timing_ = table("timing.csv", timing_header());
    else
        times_ = table("times.csv", times_header());
    if (!options_.frames) return;
    fs::create_directory(folder_->path("frames"));
    stage_ = std::make_unique<SceneStage>(scene_, world);
    const FrameThreadOptions where{options_.width, options_.height, folder_->path("frames")};
    frames_ = std::make_unique<FrameThread>(std::vector{stage_->description(options_.width, options_.height)},
                                            stage_->frame(world), where);
}

void SimulateRecord::take_frames(const sim::World& world) {
    if (!folder_) return;
    while (double(next_frame_) / options_.fps <= world.time_s() + 1e-9) {
        states_->add(state_rows(scene_, world, next_frame_));
        if (frames_) frames_->push({.index = next_frame_, .state = stage_->frame(world)});
        ++next_frame_;
    }
}

void SimulateRecord::take_step(const sim::World& world) {
    if (folder_) energy_->add(energy_row(world, !options_.workers));
}

void SimulateRecord::take_time(std::uint64_t step, double elapsed_s) {
    if (folder_) times_->add(times_row(step, elapsed_s));
}

void SimulateRecord::take_worker(const sim::WorkerStep& step) {
    if (!timing_) return;
    timing_->add(timing_row(step));
    history_.add(step);
}

void SimulateRecord::draw_workers() {
    fs::create_directories(folder_->scratch());
    write_file(folder_->path("workers.svg"), draw_svg({workers_plot(history_)}, folder_->scratch()).front());
}

void SimulateRecord::finish(SimulateResult& result, const WallTimer& wall) {
    if (!folder_) return;
    for (GrowingTable* table : {states_.get(), energy_.get(), times_.get(), timing_.get()})
        if (table) table->finish();
    if (frames_) frames_->finish();
    if (timing_) draw_workers();
    result.frames = frames_ ? frames_->written().size() : 0;
    if (options_.video) make_video(*options_.video, options_.fps, false, folder_->path("."));
    result.wall_s = wall.seconds();
    write_file(folder_->path("summary.json"), format_simulate(result));
    folder_->finish();
    if (options_.video) fs::rename(options_.video->string() + ".partial", *options_.video);
}

}  // namespace app
