#pragma once
#include <sim/distributed_world.h>
#include <simulated_processors.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pictures/camera.h"
#include "simulate/kept_accuracy.h"
#include "simulate/mishaps.h"

namespace app {

/// How a scene is shared out to workers.
struct WorkerOptions {
    int count = 0;  ///< processes started here, or simulated processors
    int bound = 4;  ///< [steps]
    bool balance = true;
    std::string listen;  ///< endpoint; empty: in a private folder
    std::filesystem::path keys;
    int expect = 0;                                           ///< workers before the first step
    std::optional<sim_bench::SimulatedProcessors> simulated;  ///< instead of processes
};

struct SimulateOptions {
    std::filesystem::path scene;
    std::optional<double> dt_s, seconds, accuracy;  ///< in place of the scene's
    std::optional<std::uint64_t> steps;
    bool until_rest = false;
    std::optional<std::filesystem::path> out, video;
    bool frames = false;  ///< kept in `out`; a video alone needs them only while it is made
    double fps = 30;
    int width = 640, height = 480;
    CameraChoice camera;
    double shutter =
        0;  ///< open for this share of the frame interval, up to the frame's time; 0: no motion blur
    bool progress = false;
    std::optional<WorkerOptions> workers;  ///< none: all in this process
    std::optional<int>
        threads;  ///< that share out each step there; none: one a processor core, 8 at most. Of
                  ///< workers: each one's; none: one
    std::uint64_t checkpoint = 0;    ///< steps after which one is saved in `out`; 0: none
    bool goes_on = false;            ///< from the checkpoint in `out`
    std::vector<std::string> words;  ///< of the command: what a checkpoint says of it
};

/// Momentum that came from nowhere.
struct MomentumDrift {
    double linear = 0;  ///< largest seen; at the end where more than gravity acted, or of workers [kg m/s]
    std::optional<double> angular;  ///< largest seen [kg m^2/s]; known where nothing at all acted
    double scale = 0;               ///< largest sum of |m v| over the bodies [kg m/s]

    /// Share of the momenta that went around.
    [[nodiscard]] double share() const { return scale > 0 ? linear / scale : linear; }
};

/// What the run gave; its counts are the world's where there are no workers.
struct SimulateResult : sim::DistributedResult {
    std::filesystem::path scene;
    std::string name;
    int bodies = 0;
    int rigid = 0, linear = 0, modal = 0;  ///< bodies by what is computed of them
    int groups_cut = 0;  ///< modal bodies whose count of modes cuts a group of equal frequencies
    std::uint64_t body_steps = 0;
    double dt_s = 0, time_s = 0;
    std::optional<MomentumDrift> drift;
    sim::World::Energy energy_start{}, energy{};
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), angular_momentum = Eigen::Vector3d::Zero();
    std::uint64_t state_hash = 0;
    std::optional<KeptAccuracy> accuracy;  ///< if one was asked for
    Mishaps mishaps;                       ///< quarantined, broken and limited with their names
    bool rest_wanted = false;
    std::size_t frames = 0;
    std::vector<std::string> failures;            ///< why plots or the video are missing
    std::vector<std::string> notes;               ///< what was asked for and had no effect; what workers said
    double wall_s = 0;                            ///< with reading, drawing and writing
    std::optional<WorkerOptions> worker_options;  ///< none: in this process
};

/// Runs a scene, in this process or shared out to workers. Throws BadInput, or std::runtime_error while
/// running.
[[nodiscard]] SimulateResult simulate(const SimulateOptions& options);

/// One JSON object, the keys that scripts rely on first; numbers read back to the same double. Apart from
/// elapsed_s, cpu_s, ns_per_body_step and wall_s a pure function of the scene and the options.
[[nodiscard]] std::string format_simulate(const SimulateResult& result);

}  // namespace app
