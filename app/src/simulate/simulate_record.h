#pragma once
#include <fstream>
#include <map>
#include <memory>
#include <optional>

#include "files/output_folder.h"
#include "pictures/frame_thread.h"
#include "pictures/scene_stage.h"
#include "process/clock.h"
#include "process/progress_bar.h"
#include "report/plot.h"
#include "scene/scene.h"
#include "simulate/simulate.h"

namespace app {

/// Compares the total momentum with the impulse that came from outside: with gravity's while nothing else
/// acts, else at the end with what the world counted (World::outside_impulse).
class MomentumWatch {
public:
    MomentumWatch(const sim::WorldScene& scene, const sim::World& world);
    void look(const sim::World& world);  ///< now and then, and at the end
    /// `outside`: the impulse since the start, if it is known. None: unknown.
    [[nodiscard]] std::optional<MomentumDrift> drift(const std::optional<Eigen::Vector3d>& outside) const;

private:
    [[nodiscard]] Eigen::Vector3d brought(const sim::World& world) const;

    const sim::WorldScene& scene_;
    bool closed_ = false;  ///< nothing acts from outside but gravity
    Eigen::Vector3d weight_ = Eigen::Vector3d::Zero(), momentum_, angular_momentum_;
    Eigen::Vector3d gained_ = Eigen::Vector3d::Zero();  ///< since the start, but by bodies that came later
    double linear_ = 0, angular_ = 0, scale_ = 0;
};

/// What each worker did over the steps, for plots: at most a few thousand points per worker, however long.
class WorkerHistory {
public:
    struct Point {
        std::uint64_t step;
        int bodies;
        double seconds;
    };

    void add(const sim::WorkerStep& step);
    /// By worker, in order of steps.
    [[nodiscard]] const std::map<int, std::vector<Point>>& workers() const { return workers_; }

private:
    std::map<int, std::vector<Point>> workers_;
    std::uint64_t every_ = 1;  ///< steps that are kept: multiples of it
};

/// Bodies of each worker and its seconds per step over the steps (figures 2-6 and 2-7 of the thesis).
[[nodiscard]] PlotScript workers_plot(const WorkerHistory& history);

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

/// Observes a run: keeps what its result says, and writes tables and pictures while it goes on. Without a
/// folder it writes nothing.
class SimulateRecord : public sim::DistributedObserver {
public:
    /// `last`: the step that ends the run at the latest.
    SimulateRecord(const SimulateOptions& options, const Scene& scene, std::uint64_t last);

    void at(std::uint64_t step, const sim::World& world) override;
    /// Takes frames: the first state that is not before a frame's time.
    void ready(std::uint64_t step, const sim::World& world) override;
    void worked(const sim::WorkerStep& step) override;
    void note(const std::string& what) override { result_.notes.push_back(what); }

    /// After the last step; `wall`: since the scene was read.
    [[nodiscard]] SimulateResult finish(const sim::DistributedResult& run, const WallTimer& wall);

private:
    void start(const sim::World& world);
    void describe(const sim::World& world);
    void take_result(const sim::DistributedResult& run);
    void write_products(const WallTimer& wall);

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
    WorkerHistory history_;
    std::size_t next_frame_ = 0;
};

}  // namespace app
