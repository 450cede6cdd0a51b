#pragma once
#include <sim/distributed_world.h>

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "report/plot.h"
#include "simulate/simulate.h"

namespace app {

/// Compares the total momentum with the impulse that came from outside: with gravity's while nothing else
/// acts, else at the end with what the world counted (World::outside_impulse).
class MomentumWatch {
public:
    /// rounded: states are, but the last (those of workers), so that only those count.
    MomentumWatch(const sim::WorldScene& scene, const sim::World& world, bool rounded);
    void look(const sim::World& world);  ///< now and then, and at the end
    /// `outside`: the impulse since the start, if it is known. None: unknown.
    [[nodiscard]] std::optional<MomentumDrift> drift(const std::optional<Eigen::Vector3d>& outside) const;

    struct Largest {  ///< seen so far, or now where rounded: of MomentumDrift, where nothing but gravity acts
        double linear = 0, angular = 0, scale = 0;
    };
    [[nodiscard]] const Largest& largest() const { return largest_; }
    void go_on(const Largest& seen) { largest_ = seen; }  ///< after the start

private:
    [[nodiscard]] Eigen::Vector3d brought(const sim::World& world) const;

    const sim::WorldScene& scene_;
    bool rounded_;
    bool closed_ = false;  ///< nothing acts from outside but gravity
    Eigen::Vector3d weight_ = Eigen::Vector3d::Zero(), momentum_, angular_momentum_;
    Eigen::Vector3d gained_ = Eigen::Vector3d::Zero();  ///< since the start, but by bodies that came later
    Largest largest_;
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
    std::uint64_t every_ = 1;  // steps that are kept are multiples of it
};

/// Bodies of each worker and its seconds per step over the steps (figures 2-6 and 2-7 of the thesis).
[[nodiscard]] PlotScript workers_plot(const WorkerHistory& history);

}  // namespace app
