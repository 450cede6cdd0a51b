#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace app {

/// The recorded path of one stick's tip, for the report's plots.
struct TipTrack {
    std::string stick;
    std::vector<double> t_s;
    std::vector<Eigen::Vector3d> tip;  ///< [m], world
};

}  // namespace app
