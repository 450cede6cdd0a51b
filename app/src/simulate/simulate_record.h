#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "files/output_folder.h"
#include "pictures/frame_thread.h"
#include "pictures/scene_stage.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "scene/scene.h"
#include "simulate/checkpoint.h"
#include "simulate/growing_table.h"
#include "simulate/run_measures.h"
#include "simulate/simulate.h"

namespace app {

/// Of a body of a scene, also one that comes later.
[[nodiscard]] const std::string& name_of(const Scene& scene, int body);

/// Observes a run: keeps what its result says, and writes tables and pictures while it goes on. Without a
/// folder it writes nothing.
class SimulateRecord : public sim::DistributedObserver {
public:
    /// `last`: the step that ends the run at the latest. `run`: what its checkpoints say of it; where it goes on, with
    /// what the interrupted run had written.
    SimulateRecord(const SimulateOptions& options, const Scene& scene, std::uint64_t last,
                   std::unique_ptr<OutputFolder> folder, Checkpoint run);

    /// Saves a checkpoint where one is due. That it cannot be saved is said, and the one before stands.
    void done(std::uint64_t step, const std::function<sim::RunState()>& state) override;

    void at(std::uint64_t step, const sim::World& world) override;

    /// Takes frames: the first state that is not before a frame's time.
    void ready(std::uint64_t, const sim::World& world) override;

    void worked(const sim::WorkerStep& s) override;

    void note(const std::string& what) override;

    /// After the last step; `wall`: since the scene was read.
    [[nodiscard]] SimulateResult finish(const sim::DistributedResult& run, const WallTimer& wall,
                                        std::optional<KeptAccuracy> accuracy);

private:
    void start(const sim::World& world);
    void go_on();
    [[nodiscard]] std::filesystem::path frame(std::uint64_t index) const;
    /// Those that the interrupted run had drawn.
    void find_frames();
    /// Has the outputs so far on the disk.
    [[nodiscard]] RecordState save_record();
    /// Takes what of the next frame's exposure has come by t_s, when the scene is as `now`.
    void expose(const render::FrameState& now, double t_s);
    void tell_spun(int body, std::uint64_t step);
    void watch_spin(std::uint64_t step, const sim::World& world);
    void describe(const sim::World& world);
    void take_result(const sim::DistributedResult& run);
    void write_products(const WallTimer& wall, double before_s);

    const SimulateOptions& options_;
    const Scene& scene_;
    std::uint64_t last_;
    SimulateResult result_;
    ProgressBar bar_;
    std::optional<MomentumWatch> momentum_;
    std::unique_ptr<OutputFolder> folder_;
    std::unique_ptr<GrowingTable> states_, energy_, steps_;
    std::unique_ptr<SceneStage> stage_;
    std::unique_ptr<FrameThread> frames_;
    std::vector<render::FrameState> exposed_;    // of the next frame, with motion blur
    std::optional<render::FrameState> reached_;  // the state before,
    double reached_s_ = 0;                       // and its time
    WorkerHistory history_;
    std::vector<bool> spun_;  // of each body: it was reported
    std::vector<std::pair<int, std::uint64_t>> reported_spun_;
    std::uint64_t next_frame_ = 0, saved_frames_ = 0;
    Checkpoint run_;
    const RecordState* from_;  // of run_, where it goes on
    bool failing_ = false;     // the last checkpoint could not be saved
    WallTimer since_start_;
};

}  // namespace app
