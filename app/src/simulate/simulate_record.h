#pragma once
#include <fstream>
#include <memory>

#include "files/output_folder.h"
#include "pictures/frame_thread.h"
#include "pictures/scene_stage.h"
#include "process/clock.h"
#include "scene/scene.h"
#include "simulate/simulate.h"
#include "simulate/worker_history.h"

namespace app {

/// A CSV file that grows while a simulation runs. Throws std::runtime_error when it cannot be written.
class GrowingTable {
public:
    GrowingTable(const std::filesystem::path& file, const std::string& header);
    void add(const std::string& rows);
    void finish();

private:
    void check() const;

    std::filesystem::path file_;
    std::ofstream out_;
};

[[nodiscard]] const std::string& name_of(const Scene& scene, std::size_t body);

/// What a run writes while it goes on. Without a folder: nothing.
class SimulateRecord {
public:
    SimulateRecord(const SimulateOptions& options, const Scene& scene);

    void start(const sim::World& world);        ///< before the first step
    void take_frames(const sim::World& world);  ///< the first state that is not before a frame's time
    void take_step(const sim::World& world);    ///< after each
    void take_worker(const sim::WorkerStep& step);
    void finish(SimulateResult& result, const WallTimer& wall);

private:
    void draw_workers();

    const SimulateOptions& options_;
    const Scene& scene_;
    std::unique_ptr<OutputFolder> folder_;
    std::unique_ptr<GrowingTable> states_, energy_, times_, timing_;
    std::unique_ptr<SceneStage> stage_;
    std::unique_ptr<FrameThread> frames_;
    WorkerHistory history_;
    std::size_t next_frame_ = 0;
};

}  // namespace app
