#include "shared/body_costs.h"

#include <algorithm>
#include <cmath>

namespace sim {

BodyCosts::BodyCosts(int bodies, double smoothing_steps)
    : weight_(1 - std::exp(-1 / std::max(smoothing_steps, 1e-3))),
      cost_(static_cast<std::size_t>(bodies), -1.0) {}

void BodyCosts::share(double seconds, const World& world, std::span<const int> bodies) {
    double sum = 0;
    for (const int body : bodies) sum += world.work(body);
    if (sum <= 0) return;
    for (const int body : bodies) {
        double& cost = cost_[static_cast<std::size_t>(body)];
        const double now = seconds * world.work(body) / sum;
        cost = cost < 0 ? now : cost + weight_ * (now - cost);
    }
}

void BodyCosts::forget(int body) {
    cost_[static_cast<std::size_t>(body)] = -1;
}

std::vector<double> pulls(const World& world, std::span<const int> own, std::span<const int> others) {
    auto centre = [&world](std::span<const int> bodies) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const int body : bodies) sum += world.state(body).position;
        return Eigen::Vector3d(sum / std::max<double>(1, static_cast<double>(bodies.size())));
    };
    const Eigen::Vector3d here = centre(own), there = centre(others);
    Eigen::Vector3d extent = Eigen::Vector3d::Zero();
    for (const int body : own) extent += (world.state(body).position - here).cwiseAbs();
    Eigen::Index longest = 0;
    extent.maxCoeff(&longest);
    std::vector<double> result;
    result.reserve(own.size());
    for (const int body : own) {
        const Eigen::Vector3d at = world.state(body).position;
        result.push_back(others.empty() ? at[longest] - here[longest]
                                        : (at - here).norm() - (at - there).norm());
    }
    return result;
}

}  // namespace sim
