#pragma once
#include <sim/distributed_world.h>

#include <map>
#include <string>
#include <vector>

#include "report/gnuplot.h"

namespace app {

/// What each worker did over the steps, for plots: at most a few thousand points a worker, however long.
class WorkerHistory {
public:
    struct Point {
        std::uint64_t step;
        int bodies;
        double seconds, smoothed_s;
    };

    void add(const sim::WorkerStep& step);
    /// By worker, in order of steps.
    [[nodiscard]] const std::map<int, std::vector<Point>>& workers() const { return workers_; }

private:
    std::map<int, std::vector<Point>> workers_;
    std::uint64_t every_ = 1;  ///< steps that are kept: multiples of it
};

/// Bodies of each worker and its seconds a step over the steps (figures 2-6 and 2-7 of the thesis).
[[nodiscard]] PlotScript workers_plot(const WorkerHistory& history);

/// A line colour a worker, repeating after the tenth: "rgb '#rrggbb'".
[[nodiscard]] std::string worker_colour(std::size_t number);

}  // namespace app
